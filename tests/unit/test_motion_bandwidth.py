"""Up to which frequency a motion counts as measured: where its spectrum stands above its floor, gaps between lines included."""

import numpy as np
import pytest
from axes import axis_model
from scipy.signal import butter, sosfiltfilt

from rhythmid.identify.inverse_dynamics.bandwidth import bandwidth_of, bandwidth_of_motion
from rhythmid.identify.inverse_dynamics.motion import Stretch

RATE, NOISE = 1000.0, 1e-4


def measured(line: float, seed: int, driven: bool = True) -> Stretch:
    """Ten seconds of a motion at 1 and 3 Hz with a line at 60 Hz of this amplitude, and white noise; whether an effort drives the line, too."""
    time = np.arange(0.0, 10.0, 1.0 / RATE)
    motion = (
        np.sin(2.0 * np.pi * time) + 0.1 * np.sin(6.0 * np.pi * time) + line * np.sin(120.0 * np.pi * time)
    )
    rng = np.random.default_rng(seed)
    noise = NOISE * rng.standard_normal(len(time))
    effort = -np.sin(2.0 * np.pi * time) - float(driven) * np.sin(120.0 * np.pi * time)
    effort += 0.1 * rng.standard_normal(len(time))
    return Stretch(0, "record", time, motion + noise, effort, 1.0 / RATE, "force", "position")


@pytest.mark.parametrize("seed", range(5))
def test_a_line_far_above_the_rest_of_the_motion_is_within_the_band(seed):
    assert 60.0 < bandwidth_of_motion([measured(2e-3, seed)])[0] < 70.0


@pytest.mark.parametrize("seed", range(5))
def test_a_vibration_that_no_effort_drives_does_not_widen_the_band(seed):
    assert bandwidth_of_motion([measured(2e-3, seed, driven=False)])[0] < 40.0


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("line", [0.0, 3e-5])
def test_noise_and_a_line_that_hardly_stands_above_it_do_not_widen_the_band(seed, line):
    assert bandwidth_of_motion([measured(line, seed)])[0] < 40.0


@pytest.mark.parametrize(("hum", "low", "high"), [(0.0, 40.0, 60.0), (0.3, 0.0, 10.0)])
def test_a_small_part_of_the_effort_that_is_explained_far_above_does_not_bring_in_what_is_not(hum, low, high):
    time, rng = np.arange(0.0, 20.0, 1.0 / RATE), np.random.default_rng(3)
    tones = [(1.0, 1.0), (0.1, 3.0), (1e-4, 45.0)]  # amplitude [m], frequency [Hz]
    turns = [2.0 * np.pi * frequency for _, frequency in tones]
    motion = sum(size * np.sin(w * time) for (size, _), w in zip(tones, turns))
    effort = sum(-size * w**2 * np.sin(w * time) for (size, _), w in zip(tones, turns))
    band = butter(4, (8.0, 30.0), "bandpass", fs=RATE, output="sos")
    noise = sosfiltfilt(band, rng.standard_normal(len(time)))
    effort = effort + hum * np.std(effort) * noise / np.std(noise)
    raw = Stretch(
        0,
        "record",
        time,
        motion + 1e-5 * rng.standard_normal(len(time)),
        effort,
        1.0 / RATE,
        "force",
        "position",
    )
    assert low <= bandwidth_of([raw], axis_model()).effort <= high
