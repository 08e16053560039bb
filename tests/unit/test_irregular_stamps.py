"""Stamps at irregular times are told from lost samples: nothing is lost where long steps lie anywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.record.quality import ChannelQuality
from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import Timing, gaps_between, nominal_period

seeds = st.integers(0, 10_000)


def mixed(rng, steps, shares, scatter, count=4000):
    """Stamps whose steps are of several kinds, in any order, each with a scatter [s]."""
    kind = rng.choice(np.asarray(steps), count, p=shares)
    return np.cumsum(kind + rng.uniform(-scatter, scatter, count))


def logger(rng):
    """A loop that takes 11 ms, or where it has more to do, 20 ms; now and then 25 to 29 ms."""
    return mixed(rng, (0.0109, 0.0201, 0.027), (0.52, 0.43, 0.05), 5e-4)


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_steps_of_two_kinds_are_irregular_and_none_is_lost(seed):
    time = logger(np.random.default_rng(seed))
    timing = Timing.of(time)
    assert timing.period == pytest.approx(float(np.mean(np.diff(time))), rel=1e-3)
    assert (timing.gaps, timing.lost, len(gaps_between(time)[0])) == (0, 0, 0)
    assert timing.usual_range == pytest.approx((0.0105, 0.0274), abs=3e-4)


@given(seed=seeds, share=st.floats(0.05, 0.3))
@settings(max_examples=20, deadline=None)
def test_rarer_long_steps_that_are_no_multiple_of_the_others_are_no_losses(seed, share):
    time = mixed(np.random.default_rng(seed), (0.0042, 0.0099), (1.0 - share, share), 1e-4)
    timing = Timing.of(time)
    assert timing.usual_range is not None and timing.gaps == 0
    assert timing.period == pytest.approx(float(np.mean(np.diff(time))), rel=1e-3)


@pytest.mark.parametrize("share", [0.2, 0.45])
def test_where_short_steps_are_common_the_usual_step_is_no_period(share):
    time = mixed(np.random.default_rng(2), (0.0042, 0.01), (share, 1.0 - share), 1e-4)
    assert Timing.of(time).usual_range is not None
    assert nominal_period(np.diff(time)) == pytest.approx(float(np.mean(np.diff(time))), rel=1e-3)


@given(seed=seeds, spread=st.floats(0.6, 0.9))
@settings(max_examples=20, deadline=None)
def test_steps_of_any_length_are_irregular(seed, spread):
    step = 0.01 * (1.0 + np.random.default_rng(seed).uniform(-spread, spread, 4000))
    timing = Timing.of(np.cumsum(step))
    assert timing.gaps == 0 and timing.period == pytest.approx(0.01, rel=0.03)


@given(seed=seeds, lost=st.floats(0.005, 0.08), jitter=st.floats(0.0, 0.2))
@settings(max_examples=20, deadline=None)
def test_lost_samples_of_a_jittering_channel_stay_losses(seed, lost, jitter):
    rng = np.random.default_rng(seed)
    time = 0.01 * (np.arange(4000) + rng.uniform(-jitter, jitter, 4000))
    kept = rng.random(4000) >= lost
    timing = Timing.of(time[kept])
    gone = np.count_nonzero(~kept[np.flatnonzero(kept)[0] : np.flatnonzero(kept)[-1]])
    assert timing.usual_range is None and timing.period == pytest.approx(0.01, rel=2e-3)
    assert timing.lost == pytest.approx(gone, rel=0.1, abs=3)


def test_lost_samples_whose_stamps_are_rounded_stay_losses():
    time = np.round(np.delete(np.arange(4000), np.arange(5, 3990, 20)) / 98.0, 3)
    timing = Timing.of(time)
    assert timing.usual_range is None and timing.lost == len(np.arange(5, 3990, 20))


def test_a_pause_among_irregular_stamps_is_a_gap():
    time = logger(np.random.default_rng(3))
    time[2000:] += 1.0
    timing = Timing.of(time)
    first, lost = gaps_between(time)
    assert timing.usual_range is not None and first.tolist() == [1999] and timing.gaps == 1
    assert lost[0] == timing.lost == pytest.approx(1.0 * timing.rate, rel=0.05)
    assert timing.period == pytest.approx(float(np.mean(np.diff(logger(np.random.default_rng(3))))), rel=1e-3)


def test_check_says_in_one_phrase_that_the_stamps_are_irregular():
    time = logger(np.random.default_rng(4))
    channel = ChannelQuality("log.csv column q", Timing.of(time))
    mean = 1.0 / float(np.mean(np.diff(time)))
    assert channel.facts() == [f"irregular stamps, usually 10.4 to 27.3 ms apart, {mean:.4g} Hz on average"]
    assert channel.complaints() == []


def test_the_uniform_grid_of_irregular_stamps_has_their_mean_rate_and_no_missing_rows():
    time = logger(np.random.default_rng(5))
    record = Record("log", Channel(time, np.sin(2.0 * time), "rad"), Channel(time, np.cos(2.0 * time), "N*m"))
    grid = record.uniform()
    assert grid.period == pytest.approx(float(np.mean(np.diff(time))), rel=1e-3) and not grid.missing.any()


def sent_by_a_busy_computer(seed: int, until: float, behind: float) -> np.ndarray:
    """Times [s] of 6000 commands of 1 kHz. From 1 s `until` another time the computer stops for 4 to 14 ms again and
    again, and then sends what is due. All the while it is `behind` [s] at most, by a share that changes slowly."""
    rng = np.random.default_rng(seed)
    due = 1e-3 * np.arange(6000)
    lag = behind * np.interp(due, np.arange(0.0, 6.1, 0.04), rng.uniform(size=153) ** 4)
    sent, stop = due + lag + 2e-5 * rng.uniform(size=6000), 1.0
    while stop < until:
        end = stop + rng.uniform(4e-3, 14e-3)
        stopped = (due >= stop) & (due < end)
        sent[stopped] = end + 1.4e-5 * np.arange(np.count_nonzero(stopped))
        stop = end + rng.uniform(1e-3, 3e-3)
    return np.sort(sent)


@pytest.mark.parametrize(("until", "behind"), [(2.2, 0.0), (2.2, 0.01), (3.9, 0.004)])
@pytest.mark.parametrize("seed", range(3))
def test_commands_that_a_busy_computer_sends_late_are_not_lost(seed, until, behind):
    timing = Timing.of(sent_by_a_busy_computer(seed, until, behind))
    assert (timing.gaps, timing.lost, timing.usual_range) == (0, 0, None)
    assert timing.period == pytest.approx(1e-3, rel=2e-3)


@pytest.mark.parametrize(("until", "behind"), [(2.2, 0.0), (2.2, 0.01), (3.9, 0.004)])
@pytest.mark.parametrize("seed", range(3))
def test_a_gap_beside_late_commands_is_found(seed, until, behind):
    time = sent_by_a_busy_computer(seed, until, behind)
    first, lost = gaps_between(time[(time < 4.0) | (time > 4.3)])
    assert len(first) == 1
    assert abs(lost[0] - 300) <= 1
