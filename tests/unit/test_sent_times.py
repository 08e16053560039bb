"""A bag that says when its messages were sent gives these times; the delay of their receipt changes nothing."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from foreign import STORE, array, joint_state

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.bag_writer import add_topic, new_bag
from rhythmid.record.columns import read_columns
from rhythmid.record.field import Field
from rhythmid.record.read import read_record
from rhythmid.record.recover import recover
from rhythmid.record.signals import Signals
from rhythmid.start.start import start

N = 2000
SENT_NS = 10**18 + 5_000_000 * np.arange(N)
SIGNALS = """
time: header
input: {topic: /command, field: "data[0]", time: TIME}
output: {topic: /joint_states, field: "position[lift]"}
"""


@dataclass(frozen=True)
class Recorded:
    """A bag of commands without stamps and joint states with stamps; `received_ns` int64[N] is when each was received."""

    path: Path
    received_ns: np.ndarray


def recorded(folder: Path, storage="mcap", known: bool = True) -> Recorded:
    """Whether the bag says when messages were sent is `known`."""
    rng = np.random.default_rng(3)
    received = np.sort(SENT_NS + rng.integers(50_000, 4_000_000, N))
    command = np.sin(0.7 * 2.0 * np.pi * 0.005 * np.arange(N)) + np.sign(
        np.sin(2.0 * np.pi * 0.13 * 0.005 * np.arange(N))
    )
    with new_bag(folder / "bag", storage) as writer:
        topics = [
            add_topic(writer, name, kind)
            for name, kind in (
                ("/command", "std_msgs/msg/Float64MultiArray"),
                ("/joint_states", "sensor_msgs/msg/JointState"),
            )
        ]
        for k, (sent, came) in enumerate(zip(SENT_NS.tolist(), received.tolist(), strict=True)):
            state = joint_state(
                sent * 1e-9, ["lift"], position=[float(np.sum(command[max(k - 20, 0) : k + 1]))]
            )
            for topic, one in zip(topics, (array([command[k]]), state), strict=True):
                writer.write(topic, came, STORE.serialize_cdr(one, one.__msgtype__), sent if known else 0)
    return Recorded(folder / "bag", received)


def read(bag: Recorded, time: str):
    return read_record(bag.path, Signals.from_text(SIGNALS.replace("TIME", time)))


def test_a_command_has_the_time_at_which_it_was_sent(tmp_path):
    bag = recorded(tmp_path)
    steps = np.diff(read(bag, "sent").input.time)
    np.testing.assert_allclose(steps, 0.005, atol=1e-8)
    assert np.std(np.diff(read(bag, "receive").input.time)) > 1e-3


def test_that_sent_times_and_stamps_are_of_one_clock_is_told_as_an_assumption(tmp_path):
    notes = read(recorded(tmp_path), "sent").quality.notes
    assert [one for one in notes if one.startswith("assumed")] == [
        "assumed: input (time of sending) and output (stamps) share one clock; an offset between the clocks counts as delay"
    ]


def test_a_recorder_that_writes_zero_for_when_messages_were_sent_does_not_say_it(tmp_path):
    wanted = {"/command": [Field.parse("data[0]")]}
    blocks = list(Bag(recorded(tmp_path).path).blocks(lambda topic: topic.name == "/command"))
    assert read_columns(blocks, wanted)["/command"].sent_ns is not None
    zero = [replace(block, sent_ns=np.zeros_like(block.log_ns)) for block in blocks]
    assert read_columns(zero, wanted)["/command"].sent_ns is None


@pytest.mark.parametrize(("storage", "known"), [("sqlite3", True), ("mcap", False)])
def test_a_bag_that_does_not_say_when_messages_were_sent_is_refused(tmp_path, storage, known):
    bag = recorded(tmp_path, storage, known)
    with pytest.raises(InputError, match="does not say when its messages were sent .* use  time: receive"):
        read(bag, "sent")


def test_a_recovered_bag_still_says_when_messages_were_sent(tmp_path):
    bag = recorded(tmp_path)
    recover(bag.path, tmp_path / "recovered")
    for topic in ("/command", "/joint_states"):
        blocks = list(Bag(tmp_path / "recovered").blocks(lambda one, name=topic: one.name == name))
        assert np.array_equal(np.concatenate([block.sent_ns for block in blocks]), SENT_NS)
        assert np.array_equal(np.concatenate([block.log_ns for block in blocks]), bag.received_ns)


@pytest.mark.parametrize(("known", "clock"), [(True, "sent"), (False, "receive")])
def test_init_compares_commands_without_stamps_by_the_best_times_of_the_bag(tmp_path, known, clock):
    begun = start([recorded(tmp_path, known=known).path])
    assert f"\ntime: {clock}" in begun.signals
