"""Command elements: what they do to u, and that they leave the forcing alone."""

import math

import numpy as np
import pytest

from rhythmid.signal import spline


def ramp(t):
    return 3.0 * t


def test_command_lag_lags_the_command_and_not_the_forcing(rig):
    model = rig.model("command_lag", {"time_constant": 0.03})
    t = np.arange(501, dtype=np.float64) * 1e-3
    forcing = spline(t, np.cos(2 * math.pi * t))
    run = rig.run(model, 0.5, command=np.ones_like, forcing=forcing)
    assert run.effort - np.cos(2 * math.pi * t) == pytest.approx(1 - np.exp(-t / 0.03), abs=1e-8)


@pytest.mark.parametrize("period", [0.005, 0.0125])
def test_command_hold_takes_the_newest_command_at_its_own_ticks(rig, period):
    run = rig.run(rig.model("command_hold", {"period": period}), 1.0, command=ramp)
    ticks = np.floor(run.time / period + 1e-6) * period
    expected = ramp(np.floor(ticks / 1e-3 + 1e-6) * 1e-3)  # the newest stamp that had come by the tick
    between = run.time - ticks > 1e-6
    assert run.effort[between] == pytest.approx(expected[between], abs=1e-9)


def test_command_hold_delays_by_half_its_period_on_average(catalogue):
    stamps = np.arange(10000, dtype=np.float64) * 1e-4
    late = catalogue["command_hold"].delay(stamps, 0.02)
    assert late.mean() == pytest.approx(0.01, rel=0.01)
    assert late.min() >= 0 and late.max() < 0.02


@pytest.mark.parametrize("name", ["command_jitter", "measurement_jitter"])
def test_jitter_repeats_with_its_seed_whole_or_in_chunks(catalogue, name):
    delay = catalogue[name].delay
    stamps = np.arange(2000, dtype=np.float64) * 1e-3
    whole = delay(stamps, 2e-4, 7.0)
    chunks = np.concatenate([delay(stamps[:801], 2e-4, 7.0), delay(stamps[801:], 2e-4, 7.0)])
    assert np.array_equal(whole, chunks)
    assert not np.allclose(whole, delay(stamps, 2e-4, 8.0))


def test_jitter_is_uniform_with_the_given_standard_deviation_and_white(catalogue):
    std = 2e-4
    late = catalogue["command_jitter"].delay(np.arange(100000, dtype=np.float64) * 1e-3, std, 1.0)
    assert late.std() == pytest.approx(std, rel=0.01)
    assert late.min() >= 0 and late.max() <= math.sqrt(12) * std
    steps = (late - late.mean()) / late.std()
    assert abs(np.mean(steps[1:] * steps[:-1])) < 0.015
    assert abs(np.mean(steps**3)) < 0.03 and np.mean(steps**4) == pytest.approx(1.8, rel=0.02)


def test_jitter_attenuates_by_its_characteristic_function(catalogue):
    std, omega = 2e-3, 2 * math.pi * 60
    stamps = np.arange(100000, dtype=np.float64) * 1e-3
    late = catalogue["command_jitter"].delay(stamps, std, 3.0)
    half = math.sqrt(3) * std
    expected = np.exp(-1j * omega * half) * np.sin(omega * half) / (omega * half)
    assert np.mean(np.exp(-1j * omega * late)) == pytest.approx(expected, abs=0.01)
    assert abs(expected) < 0.95


def test_an_input_delay_drift_stretches_the_command(rig):
    rate = 0.05
    run = rig.run(rig.model("input_delay_drift", {"rate": rate}), 1.0, command=ramp)
    assert run.effort == pytest.approx(ramp(run.time) / (1 + rate), abs=3.1e-3)  # one held sample
    assert ramp(1.0) - run.effort[-1] > 0.1
