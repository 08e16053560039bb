"""A measurement of another scale than the reference: adopted where the records have it, told, and left alone where a law says more."""

from functools import cache

import numpy as np
import pytest

from machines import CATALOGUE, only
from rhythmid.diagnose.baseline import Calibration, calibrate
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.reference_scale import with_reference_scale
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate

NOMINAL = """
units: {force: rad/s^2, position: rad}
inertia: {mass: {value: 1.0, fixed: true}}
command:
  - position_control: {proportional: {value: 250.0}, derivative: {value: 20.0}}
"""
LAWS = only("coulomb_friction", "constant_force", "bilinear_stiffness", "pendulum_gravity")
NOISE = 3e-4  # [rad]


def nominal() -> Model:
    return Model.from_text(NOMINAL, catalogue=CATALOGUE)


@cache
def servo(friction: float = 0.0, force: float = 0.0) -> Model:
    machine = nominal().with_values(
        {"position_control.proportional": 324.0, "position_control.derivative": 25.0}
    )
    machine = machine.with_element(CATALOGUE["constant_force"], {"force": force})
    return machine.with_element(CATALOGUE["coulomb_friction"], {"force": friction, "transition": 1e-2})


def moves(machine: Model, gain: float = 1.0, offset: float = 0.0, runs: int = 2) -> list[Record]:
    """Moves between random positions at 50 Hz, measured as `gain` times the position plus `offset`."""
    time = 0.02 * np.arange(400)
    made = []
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        goal = np.repeat(rng.uniform(-0.6, 0.8, 10), 40)
        reference = np.convolve(np.r_[np.zeros(11), goal], np.ones(12) / 12.0, "valid")
        position = simulate(machine, time, zero_order_hold(time, reference)).output
        value = gain * position + offset + NOISE * rng.standard_normal(len(time))
        made.append(
            Record(
                f"moves {seed}", Channel(time, value, "rad"), Channel(time, reference, "rad"), input_kind="reference"
            )
        )  # fmt: skip
    return made


def fitted(records: list[Record]) -> tuple[Calibration, Calibration]:
    """The calibration of the nominal model, without and with the test of a scale."""
    plain = calibrate(nominal(), prepare(records), CATALOGUE)
    return plain, with_reference_scale(plain, nominal(), LAWS)


def test_a_scale_of_the_measurement_is_adopted():
    plain, found = fitted(moves(servo(), 0.9))
    assert found.fit.nrmse() < 0.3 * plain.fit.nrmse()
    assert found.fit.model.value("sensor_gain.gain") == pytest.approx(0.9, abs=1e-3)


@pytest.mark.parametrize("machine", [servo(), servo(1.5, 3.0)])
def test_no_scale_is_adopted_where_the_measurement_has_none(machine):
    plain, found = fitted(moves(machine))
    assert found is plain


def test_no_scale_is_adopted_where_a_law_of_the_catalogue_predicts_better():
    heavy = servo().with_element(CATALOGUE["pendulum_gravity"], {"moment": 80.0, "reference": 0.1})
    plain, found = fitted(moves(heavy))
    assert found is plain


def test_friction_is_named_beside_a_scale_and_the_scale_is_told():
    *records, held = moves(servo(1.5), 1.05, 0.03, 3)
    found = diagnose(records, nominal(), held, LAWS).diagnosis
    assert (found.verdict, [one.element for one in found.missing]) == (
        "missing_physics",
        ["coulomb_friction"],
    )
    assert found.missing[0].parameters["force"].value == pytest.approx(1.5, rel=0.05)
    (told,) = [note for note in found.calibration if "times what follows the reference" in note]
    assert float(told.split()[3]) == pytest.approx(1.05, abs=0.003)
    assert float(told.split(", plus ")[1].split()[0]) == pytest.approx(0.03, abs=0.003)
