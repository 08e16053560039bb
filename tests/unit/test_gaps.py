"""Where commands are missing a record is cut or filled in; where measurements are missing they are missing and no more."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.joint import stretches_of
from rhythmid.identify.series import prepare, record_of
from rhythmid.record.gaps import LEAST_SAMPLES, PAST, cut_at_gaps
from rhythmid.record.interpolation import interpolation_errors
from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import gaps_between, nominal_period
from rhythmid.simulation.signal import band_limited

RATE = 200.0
TIME = np.arange(4000) / RATE
seeds = st.integers(0, 10_000)


def slow(seed):
    """A command of up to 2 Hz."""
    rng = np.random.default_rng(seed)
    return np.sum([np.sin(2 * np.pi * f * TIME + rng.uniform(0, 6)) for f in (0.3, 0.9, 1.4, 2.0)], axis=0)


def record(command, kept=None, measured=None, hold="zero"):
    """A record with noise of 1e-4 of the motion; `kept` commands, and `measured` positions."""
    chosen = np.ones(len(TIME), bool) if kept is None else kept
    seen = chosen if measured is None else measured
    position = np.sin(2 * np.pi * 0.7 * TIME) + 1e-4 * np.random.default_rng(0).standard_normal(len(TIME))
    return Record(
        "log",
        Channel(TIME[seen], position[seen], "rad"),
        Channel(TIME[chosen], np.asarray(command)[chosen], "N*m"),
        hold=hold,
    )


def without(*spans):
    keep = np.ones(len(TIME), bool)
    for begin, end in spans:
        keep &= ~((begin <= TIME) & (end > TIME))
    return keep


def test_a_record_without_gaps_is_itself_and_nothing_is_said():
    given_ = record(slow(0))
    found = cut_at_gaps(given_)
    assert found.stretches == (given_,) and found.notes == ()


@given(seed=seeds, count=st.integers(1, 5))
def test_a_record_is_cut_where_commands_are_missing(seed, count):
    begins = 1.0 + 3.5 * np.arange(count) + np.random.default_rng(seed).uniform(0.0, 1.0, count)
    kept = without(*((b, b + 0.5) for b in begins))
    found = cut_at_gaps(record(slow(seed), kept))
    assert len(found.stretches) == count + 1 and f"are missing ({count} times" in found.notes[-1]
    for one, begin in zip(found.stretches[1:], begins, strict=True):
        assert one.whole == "log" and one.name.startswith("log@")
        assert one.output.time[0] >= begin + 0.5 + PAST - 1 / RATE
        assert one.input is not None and one.input.time[0] == pytest.approx(begin + 0.5, abs=1.1 / RATE)
    assert sum(len(one.output) for one in found.stretches) > kept.sum() - count * (PAST * RATE + 2)


@given(seed=seeds)
def test_single_lost_commands_that_vary_slowly_are_filled_in(seed):
    kept = np.random.default_rng(seed).random(len(TIME)) > 0.01
    kept[[0, -1]] = True
    (one,) = cut_at_gaps(record(slow(seed), kept)).stretches
    assert one.input is not None and len(one.input) == len(TIME)
    np.testing.assert_allclose(one.input.value, slow(seed), atol=1e-3)
    assert len(one.output) == kept.sum()  # what was measured stays what was measured


def test_a_command_that_jumps_from_sample_to_sample_is_not_guessed():
    command = np.random.default_rng(2).standard_normal(len(TIME))
    found = cut_at_gaps(record(command, without((7.0, 7.005))))
    assert [len(one.output) > 1000 for one in found.stretches] == [True, True]


def test_a_held_command_that_is_the_same_before_and_after_is_not_missing():
    steps = np.repeat(np.random.default_rng(3).standard_normal(20), 200)
    given_ = record(steps, without((4.2, 4.6)))
    assert cut_at_gaps(given_).stretches == (given_,)
    assert len(cut_at_gaps(record(steps, without((4.8, 5.2)))).stretches) == 2  # it changed at 5 s


def test_a_command_that_is_sent_when_it_changes_has_no_gaps():
    sent = np.sort(np.random.default_rng(4).choice(np.arange(1, 4000), 60, replace=False))
    kept = np.isin(np.arange(4000), [0, *sent])
    given_ = record(slow(0), kept, np.ones(4000, bool))
    assert cut_at_gaps(given_).stretches == (given_,)


def test_missing_measurements_alone_cut_nothing():
    given_ = record(slow(0), np.ones(4000, bool), without((3.0, 5.0)))
    assert cut_at_gaps(given_).stretches == (given_,)


def test_stretches_that_are_too_short_are_left_out():
    found = cut_at_gaps(record(slow(0), without((5.0, 6.0), (6.0 + 0.5 * LEAST_SAMPLES / RATE, 8.0))))
    assert len(found.stretches) == 2


def test_stretches_are_one_record_in_what_follows():
    parts = cut_at_gaps(record(slow(0), without((5.0, 6.0), (9.0, 10.0)))).stretches
    made = prepare(parts)
    assert {record_of(one) for one in made} == {"log"} and len({one.name for one in made}) == 3
    whole = prepare([replace(record(slow(0)), name="log")])
    assert made[0].block == whole[0].block


@given(seed=seeds, jitter=st.floats(0.0, 0.45))
def test_jitter_alone_makes_no_gap(seed, jitter):
    time = (np.arange(500) + np.random.default_rng(seed).uniform(-jitter, jitter, 500)) / RATE
    assert len(gaps_between(np.sort(time))[0]) == 0


@given(seed=seeds)
def test_gaps_are_found_where_they_are(seed):
    first = np.sort(np.random.default_rng(seed).choice(np.arange(10, 390, 20), 5, replace=False))
    lost = np.random.default_rng(seed + 1).integers(1, 9, 5)
    gone = np.concatenate([np.arange(f, f + n) for f, n in zip(first, lost)])
    time = np.delete(np.arange(400), gone) / RATE
    before, count = gaps_between(time)
    np.testing.assert_allclose(time[before], (first - 1) / RATE)
    np.testing.assert_array_equal(count, lost)


def test_a_cubic_is_restored_to_the_last_digit_and_noise_is_not():
    missing = np.arange(1, 7)
    assert interpolation_errors((TIME - 3.0) ** 3, missing).max() < 1e-8
    noise = interpolation_errors(np.random.default_rng(0).standard_normal(4000), missing)
    assert noise[0] == pytest.approx(np.sqrt(1.0 + 2 * (2 / 3) ** 2 + 2 * (1 / 6) ** 2), rel=0.05)


def test_of_more_missing_samples_than_there_are_neighbours_tell_nothing():
    assert interpolation_errors(np.sin(TIME[:50]), np.array([4_000_000_000])) == np.inf


def test_a_band_limited_signal_with_a_gap_is_itself_on_either_side():
    value = slow(1)
    kept = without((5.0, 6.0))
    signal = band_limited(TIME[kept], value[kept])
    between = np.arange(0.5, 4.5, 0.01)
    np.testing.assert_allclose(signal(between), np.interp(between, TIME, value), atol=2e-3)
    np.testing.assert_allclose(signal(TIME[kept]), value[kept], atol=1e-9)
    assert float(signal(5.5)) == pytest.approx(
        0.5 * (value[TIME < 5.0][-1] + value[TIME >= 6.0][0]), abs=0.02
    )


def test_commands_that_were_held_up_and_came_in_a_burst_are_not_lost():
    due = 1e-3 * np.arange(6000)
    arrived = np.where((due >= 1.0) & (due < 1.02), 1.02 + 0.1 * (due - 1.0), due)
    assert len(gaps_between(arrived)[0]) == 0
    kept = (due < 3.0) | (due >= 3.02)
    first, lost = gaps_between(arrived[kept])
    assert (arrived[kept][first].round(3).tolist(), lost.tolist()) == ([2.999], [20])


def bursts(time, held, rng):
    """Stamps of samples that were held back for up to `held` [s] and then came one right after another."""
    release = np.cumsum(rng.uniform(0.2 * held, held, int(len(time) / RATE / held * 4)))
    late = release[np.searchsorted(release, time)]
    return late + 5e-5 * np.arange(len(time)) / len(time) + 1e-6 * np.arange(len(time))


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_the_period_of_samples_that_come_in_bursts_is_the_mean_one(seed):
    step = np.diff(bursts(TIME, 0.05, np.random.default_rng(seed)))
    assert nominal_period(step) == pytest.approx(1.0 / RATE, rel=0.1)


def test_samples_that_come_in_bursts_are_compared_one_by_one_and_none_is_lost():
    time = bursts(TIME, 0.05, np.random.default_rng(1))
    (made,) = prepare([Record("log", Channel(time, np.sin(2 * np.pi * 0.7 * time), "rad"))])
    assert made.block == 1 and made.used.all() and len(made.used) == len(time)


def test_a_few_gaps_do_not_end_the_averaging_of_samples():
    kept = without(*((begin, begin + 0.1) for begin in (2.0, 7.0, 15.0)))
    (made,) = prepare([record(slow(0), measured=kept)], 4)
    assert made.block == 4 and 0.9 < made.used.mean() < 1.0


def test_of_a_forced_record_no_stretch_is_kept_that_does_not_tell_the_forcings_phase():
    forcing = Channel(TIME, np.sin(2 * np.pi * TIME), "N")
    given_ = replace(record(slow(0), without((0.5, 1.0), (10.0, 10.5))), forcing=forcing)
    kept = without((0.5, 1.0), (10.0, 10.5))
    given_ = replace(given_, forcing=Channel(TIME[kept], forcing.value[kept], "N"))
    durations = [one.duration for one in stretches_of([given_])]
    assert len(durations) == 2 and min(durations) > 2.0


def test_a_command_that_came_in_bursts_costs_no_finer_steps():
    time = bursts(TIME, 0.05, np.random.default_rng(1))
    given_ = Record(
        "log",
        Channel(time, np.sin(2 * np.pi * 0.7 * time), "m"),
        Channel(time, slow(0), "N"),
        hold="zero",
    )
    run = prepare_run(paper_hopper(), prepare([given_]))
    assert run.max_step > 0.5 / RATE


@given(seed=seeds, count=st.integers(1, 40))
@settings(max_examples=20, deadline=None)
def test_a_forcing_that_repeats_is_known_where_its_samples_are_missing(seed, count):
    rng = np.random.default_rng(seed)
    kept = without(*((begin, begin + 0.12) for begin in rng.uniform(0.1, 19.8, count)))
    forcing = 0.3 + np.sin(2 * np.pi * 1.05 * TIME) + 0.2 * np.sin(2 * np.pi * 2.1 * TIME + rng.uniform(0, 6))
    given_ = replace(record(np.zeros(len(TIME))), forcing=Channel(TIME[kept], forcing[kept], "N"))
    (one,) = stretches_of([given_])
    assert one.forcing is not None and len(one.forcing) == len(TIME)
    np.testing.assert_allclose(one.forcing.value, forcing, atol=1e-6)


def test_a_forcing_that_does_not_repeat_is_cut_where_its_samples_are_missing():
    kept = without((7.0, 8.0))
    forcing = np.cumsum(np.random.default_rng(5).standard_normal(len(TIME)))
    given_ = replace(record(slow(0)), forcing=Channel(TIME[kept], forcing[kept], "N"))
    assert len(cut_at_gaps(given_).stretches) == 2


@pytest.mark.parametrize(
    "value", [0.0 * TIME, 0.0 * TIME + 3.0, 0.1 * TIME], ids=["zero", "constant", "trend"]
)
def test_a_forcing_that_does_not_oscillate_keeps_its_values_at_a_gap(value):
    kept = without((7.0, 7.1))
    given_ = replace(record(slow(0)), forcing=Channel(TIME[kept], value[kept], "N"))
    for one in cut_at_gaps(given_).stretches:
        assert one.forcing is not None and len(one.forcing) > 1000
        np.testing.assert_allclose(one.forcing.value, np.interp(one.forcing.time, TIME, value), atol=1e-9)
