"""Actuators against step responses, describing functions, exact operators and frequency responses."""

import math

import numpy as np
import pytest

from rhythmid.simulation.signal import spline


def fundamental(rig, name, values, amplitude, harmonic=1):
    """Complex harmonic of the effort per unit amplitude of a sinusoidal command at 2 Hz, in its third period."""
    model = rig.model(name, values)
    run = rig.run(model, 1.5, command=lambda t: amplitude * np.sin(4 * math.pi * t))
    last = slice(1000, 1500)
    weight = np.exp(-4j * math.pi * harmonic * run.time[last])
    return 2j * np.mean(run.effort[last] * weight) / amplitude


def test_lag_answers_a_step_exponentially(rig):
    run = rig.run(rig.model("actuator_lag", {"time_constant": 0.03}), 0.2, command=np.ones_like)
    assert run.effort == pytest.approx(1 - np.exp(-run.time / 0.03), abs=1e-8)


@pytest.mark.parametrize("tau", [0.0, 1e-9, 1e-5, 2e-4, 1e-3])
def test_a_lag_short_against_the_step_is_stable_and_delays_by_its_time_constant(rig, tau):
    model = rig.model("actuator_lag", {"time_constant": tau})
    omega = 2 * math.pi * 5.0
    grid = np.arange(601, dtype=np.float64) * 1e-3
    run = rig.run(model, 0.6, command=spline(grid, np.sin(omega * grid)), max_step=1e-3)
    late = slice(200, 600)
    phase = np.angle(2j * np.mean(run.effort[late] * np.exp(-1j * omega * run.time[late])))
    assert phase == pytest.approx(-omega * tau, abs=0.01 * omega * tau + 1e-8)
    assert np.abs(run.effort).max() < 1.01


@pytest.mark.parametrize("ratio", [0.3, 0.8])
def test_saturation_has_its_describing_function(rig, ratio):
    seen = fundamental(rig, "actuator_saturation", {"limit": ratio * 2.0}, 2.0)
    expected = 2 / math.pi * (math.asin(ratio) + ratio * math.sqrt(1 - ratio**2))
    assert seen == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("ratio", [0.1, 0.6])
def test_deadband_has_its_describing_function(rig, ratio):
    seen = fundamental(rig, "actuator_deadband", {"threshold": ratio * 2.0}, 2.0)
    expected = 1 - 2 / math.pi * (math.asin(ratio) + ratio * math.sqrt(1 - ratio**2))
    assert seen == pytest.approx(expected, abs=1e-3)


def test_nonlinearity_compresses_the_first_harmonic_and_adds_the_third(rig):
    values = {"coefficient": 0.05}
    assert fundamental(rig, "actuator_nonlinearity", values, 2.0) == pytest.approx(
        1 - 0.75 * 0.05 * 4, abs=1e-6
    )
    assert fundamental(rig, "actuator_nonlinearity", values, 2.0, 3) == pytest.approx(
        0.25 * 0.05 * 4, abs=1e-6
    )


def multisine(t):
    lines = zip((0.7, 1.9, 3.1), (5.1, 0.4, 3.2))
    return np.sum([np.sin(2 * math.pi * frequency * t + phase) for frequency, phase in lines], axis=0)


@pytest.mark.parametrize("max_step", [2.5e-4, 1.0])
def test_backlash_is_the_play_operator_whatever_the_step(rig, max_step):
    width = 0.6
    run = rig.run(rig.model("backlash", {"width": width}), 4.0, command=multisine, max_step=max_step)
    played, expected = 0.0, []
    for f in multisine(run.time):
        played = max(f - width / 2, min(f + width / 2, played))
        expected.append(played)
    assert run.effort == pytest.approx(np.array(expected), abs=1e-14)
    assert np.abs(multisine(run.time) - expected).max() > 0.29


def test_backlash_of_a_smooth_force_errs_by_its_curvature_where_it_turns(rig):
    grid = np.arange(401, dtype=np.float64) * 1e-2  # one step each
    smooth = spline(grid, multisine(grid))
    run = rig.run(rig.model("backlash", {"width": 0.6}), 3.99, command=smooth, max_step=1.0, period=1e-2)
    played, expected = 0.0, []
    for f in smooth(np.arange(399001) * 1e-5):
        played = max(f - 0.3, min(f + 0.3, played))
        expected.append(played)
    curvature = np.abs(smooth.derivative(2)(grid[:-1])).max()
    assert np.abs(run.effort - expected[::1000]).max() < 1e-2**2 * curvature / 8
    assert np.abs(smooth(run.time) - run.effort).max() > 0.29


@pytest.mark.parametrize("max_step", [1e-4, 1.0])
def test_a_rate_limit_ramps_to_every_held_value_whatever_the_step(rig, max_step):
    rate = 9.0
    run = rig.run(rig.model("actuator_rate_limit", {"rate": rate}), 4.0, command=multisine, max_step=max_step)
    held, now, expected = multisine(run.time), 0.0, [0.0]
    for f in held[:-1]:
        now += max(-rate * 1e-3, min(rate * 1e-3, f - now))
        expected.append(now)
    assert run.effort == pytest.approx(np.array(expected), abs=1e-12)
    assert np.mean(np.abs(run.effort[1:] - held[:-1]) > 1e-3) == pytest.approx(0.8, abs=0.15)


def test_a_mass_is_moved_by_what_backlash_and_a_rate_limit_leave_within_a_step(rig):
    for name, values in (("backlash", {"width": 0.6}), ("actuator_rate_limit", {"rate": 9.0})):
        model = rig.model(name, values)
        forcing = spline(np.arange(0.0, 4.1, 0.01), np.cos(2 * math.pi * np.arange(0.0, 4.1, 0.01)))
        coarse, fine = (
            rig.run(model, 4.0, command=multisine, forcing=forcing, max_step=h).position for h in (1e-3, 1e-5)
        )
        assert np.abs(coarse - fine).max() < 3e-5 * np.ptp(fine)


@pytest.mark.parametrize("ratio", [0.2, 0.7])
def test_backlash_has_its_describing_function(rig, ratio):
    seen = fundamental(
        rig, "backlash", {"width": 2 * ratio * 1.5}, 1.5
    )  # play of half width ratio * amplitude
    theta = np.linspace(0, 4 * math.pi, 200001)
    played, wave = 0.0, np.empty(len(theta))
    for k, f in enumerate(np.sin(theta)):
        played = max(f - ratio, min(f + ratio, played))
        wave[k] = played
    cycle = slice(100000, 200000)
    assert seen == pytest.approx(2j * np.mean(wave[cycle] * np.exp(-1j * theta[cycle])), abs=2e-3)
    assert seen.imag == pytest.approx(-4 / math.pi * ratio * (1 - ratio), abs=2e-3)  # area of the loop


def test_a_rate_limit_turns_a_fast_sine_into_a_triangle(rig):
    rate, frequency = 4.0, 2.0
    run = rig.run(
        rig.model("actuator_rate_limit", {"rate": rate}),
        8.0,
        command=lambda t: 5 * np.sin(2 * math.pi * frequency * t),
    )
    late = run.effort[7000:]
    assert np.abs(np.diff(late)).max() <= rate * 1e-3 * (1.0 + 1e-9)
    assert np.ptp(late) == pytest.approx(rate / (2 * frequency), rel=0.005)


def test_a_rate_limit_that_is_not_reached_changes_nothing(rig):
    grid = np.arange(1002, dtype=np.float64) * 1e-3
    smooth = spline(grid, np.sin(2 * math.pi * grid))
    run = rig.run(
        rig.model("actuator_rate_limit", {"rate": 6.3}), 1.0, command=smooth, max_step=1e-2, period=1e-2
    )
    assert run.effort == pytest.approx(np.sin(2 * math.pi * run.time), abs=1e-12)


def test_gain_scales_and_fade_weakens_the_force(rig):
    gained = rig.run(rig.model("actuator_gain", {"gain": 0.8}), 1.0, command=multisine)
    assert gained.effort == pytest.approx(0.8 * multisine(gained.time))
    faded = rig.run(rig.model("actuator_fade", {"rate": 0.3}), 1.0, command=multisine)
    assert faded.effort == pytest.approx((1 - 0.3 * faded.time) * multisine(faded.time))
