"""The bench's servo: a saved model in volts needs the voltages that its own equation says."""

import numpy as np
import pytest
from xl330_published import of_model

from rhythmid.model import Model

VOLTS = """
units: {force: V, position: rad}
inertia: {mass: {value: 0.07, unit: V*s^2/rad}}
force:
  - pendulum_gravity: {moment: {value: 5.0, unit: V}, reference: {value: -0.02, unit: rad}}
  - viscous_damper: {damping: {value: 0.4, unit: V*s/rad}}
"""
Q, V, A = np.array([0.3, -0.4, 0.5, 0.2]), np.array([1.0, 2.0, -3.0, -0.5]), np.array([4.0, -8.0, 20.0, 0.0])
LOAD = 0.07 * A + 5.0 * np.sin(Q + 0.02) + 0.4 * V  # what the motor's voltage has to carry without friction


def test_a_model_in_volts_is_its_balance_of_voltages():
    servo, left_out = of_model(Model.from_text(VOLTS))
    assert left_out == ()
    np.testing.assert_allclose(servo.voltage(Q, V, A), LOAD, rtol=1e-4, atol=1e-4)


def test_coulomb_friction_of_a_model_adds_its_level():
    servo, _ = of_model(Model.from_text(VOLTS + "  - coulomb_friction: {force: {value: 0.3, unit: V}}\n"))
    np.testing.assert_allclose(servo.voltage(Q, V, A), LOAD + 0.3 * np.sign(V), rtol=1e-4, atol=1e-4)


def test_friction_by_the_load_takes_its_share_of_the_voltage():
    servo, _ = of_model(
        Model.from_text(VOLTS + "  - load_dependent_friction: {coefficient: {value: 0.25}}\n")
    )
    volts = servo.voltage(Q, V, A)
    np.testing.assert_allclose(volts - 0.25 * np.abs(volts) * np.sign(V), LOAD, rtol=1e-4, atol=1e-3)


def test_effects_that_are_not_counted_are_named():
    _, left_out = of_model(Model.from_text(VOLTS + "  - quadratic_drag: {coefficient: {value: 0.01}}\n"))
    assert left_out == ("quadratic_drag",)


def test_the_inertia_beyond_the_load_s_is_the_rotor_s():
    servo, _ = of_model(Model.from_text(VOLTS))
    assert servo.armature == pytest.approx(0.07 * 0.49 * 9.80665 * 0.1 / 5.0 - 0.0049, rel=1e-6)
    assert servo.q_offset == 0.02
