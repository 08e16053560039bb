"""Samples that do not say where the machine was are found, and honest ones are kept."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.record.cleaning import cleaned, peak_note
from rhythmid.record.outlier import outlying_samples, repeated_samples
from rhythmid.record.quality import clipped_samples
from rhythmid.record.record import Channel, Record
from rhythmid.record.rounding import resolution

seeds = st.integers(0, 10_000)
TIME = 1e-3 * np.arange(5000)


def motion(rng: np.random.Generator, noise: float) -> np.ndarray:
    """A chirp of 10 mm with noise of a given share of it."""
    phase = 2 * np.pi * (0.5 * TIME + rng.uniform(0.2, 2.0) * TIME**2)
    return 0.01 * (np.sin(phase) + noise * rng.standard_normal(len(TIME)))


@given(seed=seeds, noise=st.sampled_from([0.0, 1e-4, 1e-3, 1e-2]), width=st.integers(1, 3))
def test_outliers_are_found_and_nothing_else(seed, noise, width):
    rng = np.random.default_rng(seed)
    value = motion(rng, noise)
    place = rng.choice(np.arange(10, 4980, 10), 7, replace=False)
    wrong = (place[:, None] + np.arange(width)).ravel()
    value[wrong] += np.repeat(rng.choice([-1.0, 1.0], 7) * rng.uniform(0.03, 1.0, 7), width)
    assert np.array_equal(np.flatnonzero(outlying_samples(value)), np.sort(wrong))


@pytest.mark.parametrize("count", [1.0 / 11.0, 360.0 / 4096])
def test_steps_of_an_encoder_that_were_rounded_again_are_no_outliers(count):
    angle = 100.0 * np.exp(-0.2 * TIME) * np.cos(11.0 * TIME)
    value = np.round(count * np.round(angle / count), 2)
    assert not outlying_samples(value).any()
    value[3000] += 5.0
    assert np.flatnonzero(outlying_samples(value)).tolist() == [3000]


@given(seed=seeds, times=st.integers(2, 10), noise=st.sampled_from([1e-4, 1e-2]))
def test_a_sensor_that_is_read_more_often_than_it_measures_keeps_its_measurements(seed, times, noise):
    fresh = motion(np.random.default_rng(seed), noise)[::times]
    value = np.repeat(fresh, times)[: len(TIME)]
    kept = ~repeated_samples(value)
    assert np.array_equal(value[kept][: len(fresh) - 2], fresh[:-2])


@given(seed=seeds, times=st.integers(2, 10))
def test_a_fine_encoder_that_is_read_too_often_keeps_its_measurements_though_its_counts_show(seed, times):
    count = 1e-6
    fresh = count * np.round(motion(np.random.default_rng(seed), 1e-4)[::times] / count)
    fresh[3] = fresh[2] + count
    value = np.repeat(fresh, times)[: len(TIME)]
    assert resolution(value) == pytest.approx(count, rel=1e-6)
    kept = ~repeated_samples(value)
    assert np.array_equal(np.flatnonzero(kept)[: len(fresh) - 2], times * np.arange(len(fresh) - 2))


def test_a_coarse_value_that_creeps_evenly_from_count_to_count_loses_no_sample():
    assert not repeated_samples(1e-3 * np.floor(np.arange(5000) / 10.0)).any()


@pytest.mark.parametrize("count", [0.0, 1e-6])
def test_of_a_rest_of_the_machine_a_sensor_that_is_read_too_often_keeps_what_it_measures(count):
    fresh = motion(np.random.default_rng(1), 1e-4)[::10]
    fresh[:50] = fresh[50]
    fresh = count * np.round(fresh / count) if count else fresh
    kept = ~repeated_samples(np.repeat(fresh, 10))
    assert np.array_equal(np.flatnonzero(kept)[:495], 10 * np.arange(495))


def test_a_sensor_that_stands_still_for_a_while_is_believed_before_and_after():
    value = motion(np.random.default_rng(1), 1e-3)
    value[1000:1060] = value[999]
    assert np.array_equal(np.flatnonzero(repeated_samples(value)), np.arange(1000, 1060))


def test_rest_is_no_repeat():
    value = np.where(TIME < 2.0, 0.1, 0.1 + 0.05 * (TIME - 2.0) ** 2)
    assert not repeated_samples(value).any()


@given(seed=seeds, step=st.sampled_from([1e-4, 3e-4, 1e-3]))
def test_rounded_values_are_all_kept_and_their_step_is_known(seed, step):
    value = step * np.round(motion(np.random.default_rng(seed), 1e-3) / step)
    assert resolution(value) == pytest.approx(step, rel=1e-6)
    assert not outlying_samples(value).any() and not repeated_samples(value).any()


def test_values_that_were_not_rounded_have_no_step():
    assert resolution(motion(np.random.default_rng(1), 1e-3)) == 0.0
    assert resolution(np.full(50, 0.3)) == 0.0


def test_values_that_differ_by_the_representation_of_numbers_only_make_no_grid():
    rest = np.repeat(1e-12 * np.arange(12), 2)
    value = np.concatenate([rest, motion(np.random.default_rng(1), 1e-3)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert resolution(value) == 0.0


def test_two_values_are_the_coarsest_rounding_and_lose_no_sample():
    value = np.where(np.sin(2 * np.pi * TIME) > 0.0, 0.1, 0.3)
    assert resolution(value) == pytest.approx(0.2)
    assert not outlying_samples(value).any() and not repeated_samples(value).any()


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
def test_a_machine_that_sticks_and_slips_keeps_all_its_samples(rate):
    """A mass that a slow spring drags over dry friction: it stands still, to the last digit, and slips within a few samples."""
    step, pull, place, speed, places = 1e-4, 0.0, 0.0, 0.0, []
    for _ in range(200_000):
        pull += 0.02 * step
        force = 400.0 * (pull - place)
        if speed == 0.0 and abs(force) < 2.0:
            pass
        else:
            after = speed + step * (force - 1.0)
            speed, place = (0.0, place) if after <= 0.0 else (after, place + step * after)
        places.append(place)
    value = np.array(places)[:: round(1.0 / (rate * step))]
    assert np.mean(np.diff(value) == 0.0) > 0.1
    assert not repeated_samples(value).any() and not clipped_samples(value).any()


@given(seed=seeds)
def test_a_grid_that_a_few_samples_miss_is_known(seed):
    rng = np.random.default_rng(seed)
    value = motion(rng, 1e-3)
    rounded = 1e-4 * np.round(value / 1e-4)
    free = rng.random(len(value)) < 0.025
    assert resolution(np.where(free, value, rounded)) == pytest.approx(1e-4, rel=1e-3)


def test_a_plateau_at_a_stop_is_not_clipping():
    """A bouncing sine pressed against a stop: it arrives at speed and leaves from rest."""
    t = TIME[:2000]
    phase = t % 0.5
    value = np.minimum(4.0 * phase, 0.5) - np.where(phase > 0.3, 12.0 * (phase - 0.3) ** 2, 0.0)
    assert np.count_nonzero(value == 0.5) > 400
    assert not clipped_samples(value).any()


@pytest.mark.parametrize("place", [1, len(TIME) - 2])
def test_an_outlier_beside_the_first_or_the_last_sample_is_found(place):
    value = motion(np.random.default_rng(2), 1e-3)
    value[place] += 0.5
    assert np.flatnonzero(outlying_samples(value)).tolist() == [place]


def test_a_motion_that_begins_or_ends_with_a_step_has_no_outlier():
    value = motion(np.random.default_rng(2), 1e-3)
    value[0] = value[-1] = 0.5
    assert not outlying_samples(value).any()


def test_a_lone_peak_far_beyond_an_acceleration_is_kept_and_told():
    def record(peak: float) -> Record:
        value = motion(np.random.default_rng(2), 1e-3)
        value[700] += peak
        return Record("run", Channel(TIME, value, "m/s^2"), None, output_kind="acceleration")

    assert peak_note(record(0.0)) is None
    assert peak_note(record(0.1)) is None  # as much as an impact makes
    told = peak_note(record(67110626.0))
    assert told is not None and "1 of 5000 samples stand far off" in told
    assert not cleaned(record(67110626.0)).left_out


@pytest.mark.parametrize("size", [0.1, 10.0, 1e3, 67110626.0])
def test_an_outlier_of_any_size_is_found_and_leaves_the_rounding_as_it_is(size):
    value = np.round(motion(np.random.default_rng(2), 1e-2), 5)
    before = resolution(value)
    value[700] += size
    assert resolution(value) == pytest.approx(before)
    assert np.flatnonzero(outlying_samples(value)).tolist() == [700]
