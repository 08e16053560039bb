"""What changes with time, against Airy's functions, pieces of sines and double integrals."""

import math

import numpy as np
import pytest
from scipy.special import airy


def test_stiffness_drift_swings_as_airys_functions(rig):
    rate, stiffness, amplitude = 0.4, 100.0, 0.05
    run = rig.run(rig.model("stiffness_drift", {"rate": rate}, spring=stiffness), 2.0, (amplitude, 0.0))
    scale = (stiffness / rate**2) ** (1 / 3)
    ai0, dai0, bi0, dbi0 = airy(-scale)
    a, b = np.linalg.solve([[ai0, bi0], [dai0, dbi0]], [amplitude, 0.0])
    ai, _, bi, _ = airy(-scale * (1 + rate * run.time))
    assert run.position == pytest.approx(a * ai + b * bi, abs=1e-8)


def test_stiffness_jump_joins_two_sines(rig):
    change, time, amplitude = 0.5, 0.3333, 0.05
    run = rig.run(
        rig.model("stiffness_jump", {"change": change, "time": time}, spring=100.0), 1.0, (amplitude, 0.0)
    )
    fast = math.sqrt(150.0)
    x, v = amplitude * math.cos(10 * time), -10 * amplitude * math.sin(10 * time)
    after = run.time - time
    expected = np.where(
        after < 0,
        amplitude * np.cos(10 * run.time),
        x * np.cos(fast * after) + v / fast * np.sin(fast * after),
    )
    assert run.position == pytest.approx(expected, abs=1e-6)


def test_periodic_disturbance_moves_a_free_mass_by_its_double_integral(rig):
    values = {"amplitude": 0.7, "frequency": 1.7, "phase": 0.6}
    run = rig.run(rig.model("periodic_disturbance", values, mass=2.0), 1.5)
    omega = 2 * math.pi * 1.7
    t = run.time
    expected = -0.7 / (2.0 * omega**2) * (np.sin(omega * t + 0.6) - math.sin(0.6) - omega * t * math.cos(0.6))
    assert run.position == pytest.approx(expected, abs=1e-9)


def test_a_drift_begins_at_the_start_of_the_record(catalogue):
    assert catalogue["stiffness_drift"].kernel(0.1, 0.0, -5.0, 0.0, 0.1, 200.0, 0.0) == 0.0
    assert catalogue["actuator_fade"].kernel(2.0, -5.0, 0.1) == 2.0
