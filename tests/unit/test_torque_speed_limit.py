"""The torque-speed limit: what force is left at a speed, against closed forms."""

import math

import numpy as np
import pytest

from machines import CATALOGUE
from rhythmid.model import Model
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

MOTOR = """
units: {force: N*m, position: rad, mass: kg*m^2}
inertia: {mass: {value: 0.5, unit: kg*m^2}}
force:
  - viscous_damper: {damping: {value: 0.2, unit: N*m*s/rad}}
actuator:
  - torque_speed_limit: {speed: {value: 10.0, unit: rad/s}, slope: {value: 0.6, unit: N*m*s/rad}}
"""
TIME = np.arange(0.0, 8.0, 1e-3)


def speed(torque: float, begin: float = 0.0) -> np.ndarray:
    """Speed of the motor that a constant torque drives."""
    model = Model.from_text(MOTOR, catalogue=CATALOGUE)
    return simulate(
        model, TIME, zero_order_hold(np.array([-1.0]), np.array([torque])), initial=(0.0, begin)
    ).velocity


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_large_torque_drives_the_motor_as_its_supply_alone_does(side):
    """On the line s (v0 - v) the motor is linear: it tends to s v0 / (s + c) with the time constant J / (s + c)."""
    seen = speed(side * 100.0)
    expected = side * 6.0 / 0.8 * (1.0 - np.exp(-TIME * 0.8 / 0.5))
    np.testing.assert_allclose(seen, expected, atol=1e-4)


def test_below_the_line_the_torque_is_what_was_asked_for():
    np.testing.assert_allclose(speed(1.0), 1.0 / 0.2 * (1.0 - np.exp(-TIME * 0.2 / 0.5)), atol=1e-6)


def test_a_motor_that_turns_faster_than_its_supply_allows_is_braked():
    seen = speed(0.0, begin=20.0)
    assert seen[500] < 20.0 * math.exp(-0.5 * 0.2 / 0.5) - 1.0
