"""Command elements: what they do to u, and that they leave the forcing alone."""

import math

import numpy as np
import pytest

from rhythmid.simulation.signal import spline


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


def test_position_control_settles_a_step_as_a_second_order_system(rig):
    """x/r = k_p / (m s² + k_d s + k_p), whose step response is known; the forcing still acts as a force."""
    mass, proportional, derivative = 2.0, 800.0, 24.0
    model = rig.model("position_control", {"proportional": proportional, "derivative": derivative}, mass=mass)
    run = rig.run(model, 1.0, command=lambda t: np.full_like(t, 0.1))
    omega, zeta = math.sqrt(proportional / mass), derivative / (2.0 * math.sqrt(proportional * mass))
    damped, t = omega * math.sqrt(1.0 - zeta**2), run.time
    turned = np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t)
    assert run.position == pytest.approx(0.1 * (1.0 - np.exp(-zeta * omega * t) * turned), abs=1e-8)
    assert run.effort == pytest.approx(
        proportional * (0.1 - run.position) - derivative * run.velocity, abs=1e-9
    )
    pushed = rig.run(model, 3.0, forcing=spline(np.arange(0.0, 4.0, 0.5), np.full(8, 4.0)))
    assert pushed.position[-1] == pytest.approx(4.0 / proportional, rel=1e-6)


def test_velocity_control_approaches_the_reference_speed_exponentially(rig):
    run = rig.run(
        rig.model("velocity_control", {"gain": 5.0}, mass=2.0), 1.0, command=lambda t: np.full_like(t, 0.3)
    )
    assert run.velocity == pytest.approx(0.3 * (1.0 - np.exp(-2.5 * run.time)), abs=1e-9)


def test_other_command_elements_act_on_the_reference_whatever_their_order(rig, catalogue):
    loop, lag = {"proportional": 800.0, "derivative": 24.0}, {"time_constant": 0.05}
    first = rig.model("command_lag", lag, mass=2.0).with_element(catalogue["position_control"], loop)
    last = rig.model("position_control", loop, mass=2.0).with_element(catalogue["command_lag"], lag)
    runs = [rig.run(model, 0.5, command=ramp).position for model in (first, last)]
    assert np.array_equal(*runs) and np.ptp(runs[0]) > 0.1


def test_reference_rate_limit_follows_at_most_at_its_rate_from_where_the_machine_is(rig, catalogue):
    loop = rig.model("position_control", {"proportional": 1e4, "derivative": 200.0}, mass=1.0)
    limited = loop.with_element(catalogue["reference_rate_limit"], {"rate": 0.5})
    run = rig.run(limited, 1.0, initial=(0.2, 0.0), command=lambda t: np.full_like(t, 0.6))
    point = (run.effort + 200.0 * run.velocity) / 1e4 + run.position
    assert point == pytest.approx(np.minimum(0.2 + 0.5 * run.time, 0.6), abs=1e-9)
    slope = spline(np.array([0.0, 0.5, 1.0, 1.5]), np.array([0.0, 0.15, 0.3, 0.45]))
    slow, free = rig.run(limited, 1.0, command=slope), rig.run(loop, 1.0, command=slope)
    assert slow.position == pytest.approx(free.position, abs=1e-9)
