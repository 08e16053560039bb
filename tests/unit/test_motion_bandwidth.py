"""Up to which frequency a motion counts as measured: where its spectrum stands above its floor, gaps between lines included; and up to which
the effort is compared with it: where they are coherent."""

import numpy as np
import pytest
from axes import axis_model
from scipy.signal import butter, sosfiltfilt

from rhythmid.identify.inverse_dynamics.applicability import applicable
from rhythmid.identify.inverse_dynamics.bandwidth import bandwidth_of, bandwidth_of_motion
from rhythmid.identify.inverse_dynamics.motion import Stretch
from rhythmid.record.record import Channel, Record

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


MODE = 12.0  # Hz, of a second mass with the first one held


def excited(top: float, noise: float = 0.0, alone: float = 0.0) -> Stretch:
    """Twenty seconds of a unit mass with a second one of 0.7 on a spring, by an effort of 2 N rms with lines from 0.5 Hz to `top` [Hz].

    `noise` is that of the position [m] beside its 1e-8; `alone` is the size [N] of an effort that moves nothing.
    """
    rate, rng = 500.0, np.random.default_rng(4)
    time = np.arange(0.0, 20.0, 1.0 / rate)
    lines = np.arange(0.5, top, 0.35)
    w, mode = 2.0 * np.pi * lines, 2.0 * np.pi * MODE
    spring = mode**2 + 2j * 0.02 * mode * w
    inertia = 1.0 + 0.7 * spring / (spring - w**2)
    turns = np.exp(1j * (np.outer(time, w) + rng.uniform(0.0, 2.0 * np.pi, len(w))))
    size = 2.0 * np.sqrt(2.0 / len(w))
    effort = (size * turns).real.sum(axis=1) + alone * rng.standard_normal(len(time))
    position = (size * turns / (-(w**2) * inertia + 1j * w)).real.sum(axis=1)
    position = position + (1e-8 + noise) * rng.standard_normal(len(time))
    return Stretch(0, "record", time, position, effort, 1.0 / rate, "force", "position")


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_resonance_that_the_model_lacks_does_not_end_the_band_of_the_effort(noise):
    found = bandwidth_of([excited(30.0, noise=noise)], axis_model())
    assert found.effort > 28.0 and found.explained > 0.85 and found.left_out < 0.05


def test_an_effort_that_moves_nothing_ends_the_band_where_it_exceeds_the_one_that_moves_the_machine():
    assert bandwidth_of([excited(30.0, alone=8.0)], axis_model()).effort < MODE


def test_noise_of_the_position_that_exceeds_the_acceleration_ends_the_band():
    assert bandwidth_of([excited(30.0, noise=1e-3)], axis_model()).effort < MODE


@pytest.mark.parametrize(("top", "said"), [(30.0, 1), (8.0, 0)])
def test_a_band_above_that_of_the_comparison_is_told_where_the_effort_goes_with_the_motion(top, said):
    raw = excited(top, noise=2e-6)
    slow = slice(None, None, 5)  # at 100 Hz the derivatives of a spline end at 20 Hz
    effort = Channel(raw.time[slow], raw.drive[slow], "N")
    record = Record("run", Channel(raw.time[slow], raw.output[slow], "m"), effort, input_kind="force")
    way = applicable([record], axis_model())
    assert way.applies and way.band_left_out == bool(said)
    assert sum("is not compared by effort" in note for note in way.notes) == said
