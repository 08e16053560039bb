"""A command that nobody renews is held for its time, fades to zero, and is counted; one that is renewed is left alone."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.simulation.command_hold import CommandHold

MS = 1_000_000


def test_it_is_held_for_the_timeout_and_then_fades_in_steps_of_a_sample():
    hold = CommandHold(0.1, 0.004, MS)
    hold.renew(7 * MS, 2.0)
    assert hold.until(7 * MS + 100 * MS - 1) == [] and hold.effort == 2.0
    steps = hold.until(10_000 * MS)
    assert steps == [(107 * MS, 1.5), (108 * MS, 1.0), (109 * MS, 0.5), (110 * MS, 0.0)]
    assert hold.effort == 0.0 and hold.lapses == 1
    assert hold.until(20_000 * MS) == [] and hold.lapses == 1


def test_each_step_is_told_once():
    hold = CommandHold(0.1, 0.01, MS)
    hold.renew(0, 1.0)
    told = [step for now in range(0, 200 * MS, MS // 3) for step in hold.until(now)]
    assert len(told) == 10 and told[-1] == (109 * MS, 0.0)


def test_a_zero_command_has_nothing_to_end():
    hold = CommandHold(0.1, 0.01, MS)
    hold.renew(0, 0.0)
    assert hold.until(10**12) == [] and hold.lapses == 0


def test_a_renewed_command_is_in_force_again():
    hold = CommandHold(0.1, 0.01, MS)
    hold.renew(0, 1.0)
    hold.until(500 * MS)
    hold.renew(501 * MS, 0.3)
    assert hold.effort == 0.3 and hold.until(600 * MS) == []


def test_zero_as_timeout_holds_for_ever():
    hold = CommandHold(0.0, 0.01, MS)
    hold.renew(0, 1.0)
    assert hold.until(10**15) == [] and hold.effort == 1.0


def test_commands_at_a_low_rate_do_not_lapse():
    period_ns = 400 * MS  # longer than the timeout
    hold = CommandHold(0.1, 0.02, period_ns)
    for k in range(10):
        hold.renew(k * period_ns, 1.0)
        assert hold.until((k + 1) * period_ns + period_ns // 2) == []
    assert hold.lapses == 0


pauses = st.lists(st.integers(1, 400 * MS), min_size=1, max_size=30)


@settings(max_examples=100, deadline=None)
@given(pauses, st.integers(1, 30))
def test_a_whole_record_and_its_chunks_get_the_same_steps_down(steps, chunk):
    stamps = np.cumsum(np.array(steps, dtype=np.int64))
    efforts = np.arange(1.0, len(stamps) + 1.0)
    whole = CommandHold(0.1, 0.02, MS)
    expected = whole.fill(stamps, efforts)
    pieces = CommandHold(0.1, 0.02, MS)
    parts = [pieces.fill(stamps[k : k + chunk], efforts[k : k + chunk]) for k in range(0, len(stamps), chunk)]
    assert np.array_equal(np.concatenate([part[0] for part in parts]), expected[0])
    assert np.array_equal(np.concatenate([part[1] for part in parts]), expected[1])
    assert np.all(np.diff(expected[0]) > 0) and set(stamps) <= set(expected[0])
    assert whole.lapses == pieces.lapses == sum(pause > 100 * MS for pause in steps[1:])


@settings(max_examples=100, deadline=None)
@given(pauses)
def test_one_by_one_is_the_same_as_all_at_once(steps):
    stamps = np.cumsum(np.array(steps, dtype=np.int64))
    efforts = np.arange(1.0, len(stamps) + 1.0)
    hold, told = CommandHold(0.1, 0.02, MS), []
    for stamp, effort in zip(stamps.tolist(), efforts.tolist(), strict=True):
        told += hold.until(stamp - 1)
        hold.renew(stamp, effort)
        told.append((stamp, effort))
    expected = CommandHold(0.1, 0.02, MS).fill(stamps, efforts)
    assert told == list(zip(*(part.tolist() for part in expected), strict=True))
