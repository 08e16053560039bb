"""The step that values were rounded to is known where it depends on their size, and no sample is left out for it."""

import numpy as np
import pytest

from rhythmid.record.channel_quality import channel_quality
from rhythmid.record.outlier import outlying_samples, repeated_samples
from rhythmid.record.rounding import resolution, resolutions, shown_resolution
from rhythmid.record.stamp_jitter import stamp_jitter

TIME = 2e-4 * np.arange(45_000)
SCALE = 3.125e-3  # rad, of a count


def angle() -> np.ndarray:
    """Counts of a joint that swings slowly through several powers of ten, mostly where they are large."""
    return 600.0 * np.sin(1.5 * TIME) + 80.0 * np.sin(7.0 * TIME)


def written(value: np.ndarray, digits: int) -> np.ndarray:
    """What a file gives back that holds so many significant digits."""
    return np.array([float(f"{one:.{digits}g}") for one in value])


def test_of_numbers_with_five_digits_each_power_of_ten_has_its_step_whatever_their_scale() -> None:
    value = SCALE * written(angle(), 5)
    found, size = resolutions(value), np.abs(value)
    for least, most, step in ((110.0, 660.0, 1e-2), (20.0, 90.0, 1e-3)):
        inside = (size > SCALE * least) & (size < SCALE * most)
        assert found[inside] == pytest.approx(SCALE * step, rel=1e-3)
    assert resolution(value) == pytest.approx(SCALE * 1e-2, rel=1e-3)


def test_the_step_of_half_precision_doubles_with_each_power_of_two() -> None:
    value = angle().astype(np.float16).astype(np.float64)
    found = resolutions(value)
    for power in (8, 7, 6):
        inside = (np.abs(value) > 1.2 * 2.0**power) & (np.abs(value) < 1.9 * 2.0**power)
        assert found[inside] == pytest.approx(2.0 ** (power - 10))


@pytest.mark.parametrize("digits", [4, 5])
def test_no_number_with_few_digits_stands_off_its_neighbours(digits: int) -> None:
    value = SCALE * written(angle(), digits)
    assert not outlying_samples(value).any() and not repeated_samples(value).any()


def test_a_blow_is_still_found_among_numbers_with_few_digits() -> None:
    counts = written(angle(), 5)
    counts[[5_000, 20_000]] += 40.0
    assert np.flatnonzero(outlying_samples(SCALE * counts)).tolist() == [5_000, 20_000]


def test_single_precision_of_noisy_values_is_no_rounding() -> None:
    value = angle() + np.random.default_rng(1).normal(size=len(TIME))
    assert resolution(value.astype(np.float32).astype(np.float64)) == 0.0


def test_a_square_wave_is_not_said_to_be_rounded_to_its_height() -> None:
    command = np.select([np.sin(TIME) > 0.5, np.sin(TIME) < -0.5], [2.8, 0.35], 1.57)
    assert shown_resolution(command) == 0.0
    assert not channel_quality("q", TIME, None, TIME, command, False, 0, 0).facts()[1:]


@pytest.mark.parametrize("motion", [np.cos(10.0 * TIME), np.sin(8.0 * TIME**1.5), TIME**2])
def test_a_smooth_motion_without_noise_that_is_read_evenly_lies_on_no_grid(motion: np.ndarray) -> None:
    assert resolution(motion) == 0.0


def test_rounding_that_grows_with_the_size_is_no_jitter_of_the_stamps() -> None:
    assert stamp_jitter([(TIME, SCALE * written(angle() ** 2 / 600.0, 4))]) is None


def test_steps_that_do_not_follow_the_size_of_the_numbers_are_no_number_of_digits() -> None:
    few = np.arange(200)
    value = np.concatenate([0.15 + 1e-5 * few, 0.45 + 2.5671234e-3 * few])  # 2^8 apart at thrice the size
    assert resolution(value) == 0.0
