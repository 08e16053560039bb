"""A motor that is fed with a voltage: against closed forms, alone and under a position controller, and its units."""

import numpy as np
import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.compiled import compile_model
from rhythmid.simulation.effect import Path, effect_along
from rhythmid.simulation.right_hand_side import Variant
from rhythmid.simulation.signal import pieces, zero_order_hold
from rhythmid.simulation.simulate import simulate

CATALOGUE = load_catalogue()
KT, R, J, SUPPLY = 0.3, 2.5, 0.02, 7.4
MOTOR = f"""
inertia: {{mass: {{value: {J}, unit: kg*m^2}}}}
actuator: [{{dc_motor: {{torque_constant: {{value: {KT}, unit: N*m/A}}, resistance: {{value: {R}, unit: ohm}}}}}}]
"""
SERVO = f"""
inertia: {{mass: {{value: {J}, unit: kg*m^2}}}}
command: [{{position_control: {{proportional: {{value: 20.0, unit: V/rad}}}}}}]
actuator:
  - actuator_saturation: {{limit: {{value: 50.0, unit: V}}}}
  - dc_motor: {{torque_constant: {KT}, resistance: {R}}}
"""
TIME = np.arange(2001) * 1e-3


def stepped(model: Model, height: float):
    command = zero_order_hold(np.array([0.0]), np.array([height]))
    return simulate(model, TIME, command)


def test_a_motor_on_a_constant_voltage_reaches_its_no_load_speed_with_its_mechanical_time_constant():
    run = stepped(Model.from_text(MOTOR, catalogue=CATALOGUE), 6.0)
    tau = J * R / KT**2
    assert run.velocity == pytest.approx(6.0 / KT * (1.0 - np.exp(-TIME / tau)), abs=1e-6)
    assert run.effort == pytest.approx(KT / R * (6.0 - KT * run.velocity), abs=1e-9)


def test_a_duty_cycle_is_a_share_of_the_supply():
    volts = Model.from_text(MOTOR, catalogue=CATALOGUE)
    duty = volts.with_values({"dc_motor.supply": SUPPLY})
    assert stepped(duty, 0.5).position == pytest.approx(stepped(volts, 0.5 * SUPPLY).position, abs=1e-12)


def test_a_position_servo_is_a_controller_in_volts_and_a_motor():
    model = Model.from_text(SERVO, catalogue=CATALOGUE)
    reference = zero_order_hold(np.array([0.0]), np.array([0.1]))
    compiled = compile_model(model, Variant("reference"))
    out = np.empty((len(TIME), 4))
    none = pieces(None)
    compiled.run(
        TIME, *pieces(reference), *none, *none, compiled.layout.vector(model), np.zeros(2), 2.5e-4, out
    )
    k, c = KT / R * 20.0, KT**2 / R
    damping, natural = c / (2 * J), np.sqrt(k / J)
    damped = np.sqrt(natural**2 - damping**2)
    answer = 1 - np.exp(-damping * TIME) * (np.cos(damped * TIME) + damping / damped * np.sin(damped * TIME))
    assert out[:, 0] == pytest.approx(0.1 * answer, abs=1e-8)


def test_what_stands_before_the_motor_is_in_its_unit_and_a_newton_there_is_refused():
    model = Model.from_text(SERVO, catalogue=CATALOGUE)
    units = {name: value.unit for name, value in model.parameters.items()}
    assert units["position_control.proportional"] == "V/rad"
    assert units["position_control.derivative"] == "V*s/rad"
    assert units["actuator_saturation.limit"] == "V"
    assert units["dc_motor.torque_constant"] == "N*m/A"
    with pytest.raises(InputError, match=r"N\*m/rad.*'V/rad' is expected"):
        Model.from_text(SERVO.replace("V/rad", "N*m/rad"), catalogue=CATALOGUE)


def test_a_model_with_a_motor_is_read_back_as_it_was_written():
    model = Model.from_text(SERVO, catalogue=CATALOGUE)
    again = Model.from_text(model.to_yaml(), catalogue=CATALOGUE)
    assert again.parameters == model.parameters


def test_a_command_element_that_joins_a_motor_s_model_is_in_volts_too():
    model = Model.from_text(MOTOR, catalogue=CATALOGUE)
    joined = model.with_element(CATALOGUE["velocity_control"], {"gain": 1.0})
    assert joined.parameters["velocity_control.gain"].unit == "V*s/rad"


def test_along_a_path_the_motor_changes_its_signal_as_in_the_simulator():
    model = Model.from_text(MOTOR, catalogue=CATALOGUE)
    run = stepped(model, 6.0)
    volts = np.full(len(TIME), 6.0)
    path = Path(TIME, run.position, run.velocity, volts, volts, volts)
    got = effect_along(CATALOGUE["dc_motor"], {"torque_constant": KT, "resistance": R}, model, path)
    assert got == pytest.approx(run.effort - volts, abs=1e-9)


def test_back_emf_beside_a_free_damper_is_said_to_be_unidentifiable():
    assert "identifiable" in CATALOGUE["dc_motor"].confusable["viscous_damper"]
    emf, damper = KT**2 / R, CATALOGUE["viscous_damper"]
    motor = Model.from_text(MOTOR, catalogue=CATALOGUE).with_element(damper, {"damping": 0.01})
    weak = motor.with_values(
        {
            "dc_motor.torque_constant": KT / 2,
            "dc_motor.resistance": R / 2,
            "viscous_damper.damping": 0.01 + emf / 2,
        }
    )
    assert stepped(weak, 6.0).position == pytest.approx(stepped(motor, 6.0).position, abs=1e-9)
