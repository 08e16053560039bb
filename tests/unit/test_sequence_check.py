"""Messages of a second publisher are told by their sequence numbers."""

from rhythmid_nodes.sequence_check import SequenceCheck


def test_a_second_publishers_messages_are_refused_and_counted():
    check = SequenceCheck()
    assert all(check.admits(number, lambda: 1) for number in range(500, 510))
    heard = [(510, True), (1, False), (2, False), (511, True), (3, False), (512, True)]
    assert [check.admits(number, lambda: 2) for number, _ in heard] == [ours for _, ours in heard]
    assert check.foreign == 3


def test_a_loss_and_a_successor_are_admitted_while_there_is_one_publisher():
    check = SequenceCheck()
    assert all(check.admits(number, lambda: 1) for number in (5, 6, 90, 91, 1, 2))
    assert check.foreign == 0


def test_who_publishes_is_asked_only_out_of_order():
    check, asked = SequenceCheck(), []

    def publishers():
        asked.append(1)
        return 1

    assert all(check.admits(number, publishers) for number in (1, 2, 3)) and not asked
    assert check.admits(5, publishers) and len(asked) == 1
