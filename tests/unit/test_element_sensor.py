"""Sensors and clocks, looking at a mass that swings as x = A sin(omega t)."""

import math

import numpy as np
import pytest

AMPLITUDE, OMEGA = 0.05, 10.0


def swing(t):
    return AMPLITUDE * np.sin(OMEGA * t)


@pytest.fixture
def seen(rig):
    def run(name, values, duration=2.0, max_step=2.5e-4, **more):
        model = rig.model(name, values, spring=OMEGA**2)
        return rig.run(model, duration, (0.0, AMPLITUDE * OMEGA), max_step=max_step, **more)

    return run


def test_sensor_lag_has_the_frequency_response_of_a_first_order(seen):
    tau = 0.04
    run = seen("sensor_lag", {"time_constant": tau})
    expected = np.imag(AMPLITUDE * np.exp(1j * OMEGA * run.time) / (1 + 1j * OMEGA * tau))
    late = run.time > 1.0
    assert run.output[late] == pytest.approx(expected[late], abs=1e-8)
    assert run.position == pytest.approx(swing(run.time), abs=1e-7)


def test_sensor_lag_starts_as_if_the_machine_had_moved_before(seen):
    tau = 0.01
    run = seen("sensor_lag", {"time_constant": tau}, duration=0.05)
    steady = np.imag(AMPLITUDE * np.exp(1j * OMEGA * run.time) / (1 + 1j * OMEGA * tau))
    assert run.output == pytest.approx(steady, abs=0.01 * AMPLITUDE)


@pytest.mark.parametrize("tau", [0.0, 1e-8, 3e-4])
def test_a_sensor_lag_short_against_the_step_delays_by_its_time_constant(seen, tau):
    run = seen("sensor_lag", {"time_constant": tau}, max_step=1e-3)
    settled = run.time > 0.02
    assert run.output[settled] == pytest.approx(
        swing(run.time - tau)[settled], abs=0.01 * AMPLITUDE * OMEGA * tau + 1e-7
    )


@pytest.mark.parametrize(
    ("name", "values", "law"),
    [
        (
            "sensor_nonlinearity",
            {"coefficient": 0.7, "reference": 0.01},
            lambda y, t: y + 0.7 * (y - 0.01) ** 2,
        ),
        ("sensor_gain", {"gain": 1.1}, lambda y, t: 1.1 * y),
        ("sensor_offset", {"offset": 0.02}, lambda y, t: y + 0.02),
        ("sensor_drift", {"rate": 0.003}, lambda y, t: y + 0.003 * t),
    ],
)
def test_static_sensors_change_the_output_and_not_the_motion(seen, name, values, law):
    run = seen(name, values)
    assert run.output == pytest.approx(law(swing(run.time), run.time), abs=1e-7)
    assert run.position == pytest.approx(swing(run.time), abs=1e-7)


def test_quantised_samples_are_whole_steps_with_an_error_of_a_twelfth_of_a_step_squared(seen):
    step = 1e-4
    run = seen("sensor_quantisation", {"resolution": step}, duration=6.0, seed=0)
    assert np.abs(run.output / step - np.round(run.output / step)).max() < 1e-9
    error = run.output - swing(run.time)
    assert np.var(error) == pytest.approx(step**2 / 12, rel=0.05)
    assert abs(error.mean()) < 0.05 * step


def test_measurement_jitter_is_noise_that_grows_with_the_speed(seen):
    std = 2e-4
    run = seen("measurement_jitter", {"std": std, "seed": 4.0}, duration=6.0)
    error = run.output - swing(run.time - run.physical[0] - math.sqrt(3) * std)
    speed = AMPLITUDE * OMEGA * np.cos(OMEGA * run.time)
    fast, slow = np.abs(speed) > 0.9 * speed.max(), np.abs(speed) < 0.1 * speed.max()
    assert np.std(error[fast]) == pytest.approx(std * np.sqrt(np.mean(speed[fast] ** 2)), rel=0.05)
    assert np.std(error[slow]) < 0.2 * np.std(error[fast])


def test_samples_keep_their_order_under_jitter_longer_than_the_sample_period(seen):
    run = seen("measurement_jitter", {"std": 3e-3, "seed": 4.0})
    assert np.all(np.diff(run.physical) >= 0)
    assert np.all(run.physical <= run.time)


@pytest.mark.parametrize("skew", [0.01, -0.01])
def test_a_skewed_clock_stamps_what_was_taken_at_another_time(seen, skew):
    run = seen("clock_skew", {"skew": skew})
    assert run.output == pytest.approx(swing(run.time / (1 + skew)), abs=1e-6)


def test_a_drifting_measurement_delay_grows_with_the_stamp(seen):
    run = seen("delay_drift", {"rate": 0.02})
    assert run.output == pytest.approx(swing(run.time * 0.98), abs=1e-6)


def test_a_delay_drift_and_a_clock_skew_are_the_same_record(catalogue):
    stamps = np.linspace(0, 100, 11)
    rate = 0.02
    drifted = catalogue["delay_drift"].delay(stamps, rate)
    assert catalogue["clock_skew"].delay(stamps, rate / (1 - rate)) == pytest.approx(drifted)
