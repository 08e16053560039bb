"""Skew of clocks is told by arrivals, however single messages are held up, and the notes say what runs apart."""

import numpy as np
import pytest

from rhythmid.record.channel_quality import channel_quality
from rhythmid.record.clock_skew import clock_skew
from rhythmid.record.clocks import assumed_columns, clock_notes
from rhythmid.record.quality import ChannelQuality

STAMPS = np.arange(30_000) * 1e-3


def lateness(rate: float, seed: int) -> np.ndarray:
    """Receipt less stamp of messages that are under way for 0.3 ms and some, a few of them for long."""
    rng = np.random.default_rng(seed)
    held = rng.exponential(2e-4, len(STAMPS)) + 0.02 * (rng.random(len(STAMPS)) < 0.01)
    return 3e-4 + held - rate * STAMPS


def channel(rate: float, seed: int) -> ChannelQuality:
    return channel_quality("made", STAMPS, lateness(rate, seed), STAMPS, np.sin(STAMPS), False, 0, 0)


def test_the_skew_lies_within_its_uncertainty():
    z = []
    for seed in range(40):
        found = clock_skew(STAMPS, lateness(5e-5, seed))
        assert found is not None and found.std < 1e-6
        z.append((found.rate - 5e-5) / found.std)
    assert 0.6 < np.std(z) < 1.5 and abs(np.mean(z)) < 0.6


def test_too_short_a_recording_tells_no_skew():
    assert clock_skew(STAMPS[:100], lateness(0.0, 0)[:100]) is None


@pytest.mark.parametrize("clock", ["header", "receive"])
def test_clocks_that_run_apart_are_told_with_the_uncertainty(clock):
    (note,) = [
        one
        for one in clock_notes(
            {"input": channel(0.0, 1), "output": channel(5e-5, 2)}, {"input": clock, "output": "header"}
        )
        if "drifts" in one
    ]
    assert note.startswith("the clock of the output drifts by +") and "µs/s against that of the input" in note
    assert "use  time: receive  for both" in note


def test_two_channels_of_one_clock_that_differs_from_the_recorders_do_not_run_apart():
    both = {"input": channel(5e-5, 1), "output": channel(5e-5, 2)}
    assert clock_notes(both, {"input": "header", "output": "header"}) == ()


def test_times_in_different_columns_of_a_table_are_assumed_to_share_one_clock():
    (note,) = assumed_columns({"input": "t", "output": "t2", "velocity": "t2"})
    assert note.startswith("assumed: input (times in t) and output, velocity (times in t2) share one clock")
    assert assumed_columns({"input": "t", "output": "t"}) == ()
