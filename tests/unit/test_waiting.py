"""A node that waits says so after two seconds, and then at most every ten."""

from rhythmid_nodes.waiting import AGAIN, FIRST, Waiting


def told(waits, until=30.0, step=0.25):
    """Times at which a node says what it waits for; `waits(time)` is whether it does."""
    waiting = Waiting()
    times = [step * k for k in range(round(until / step) + 1)]
    return [time for time in times if waiting.due(waits(time), time)]


def test_it_is_told_soon_and_then_seldom():
    assert told(lambda _time: True) == [FIRST, FIRST + AGAIN, FIRST + 2 * AGAIN]


def test_a_short_wait_is_not_told():
    assert told(lambda time: time < FIRST) == []


def test_a_wait_that_comes_and_goes_is_told_no_more_often():
    found = told(lambda time: time % 3.0 != 0.0)
    assert found[0] >= FIRST
    assert all(later - earlier >= AGAIN for earlier, later in zip(found, found[1:], strict=False))
