"""A friction beside a constant force that is larger: no friction by direction, which would push one way, is both."""

import numpy as np
import pytest

from machines import CATALOGUE
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

LAWS = ("asymmetric_coulomb_friction", "coulomb_friction", "constant_force")
MODEL = """
units: {force: A, position: rad, mass: A*s^2/rad}
inertia: {mass: {value: 0.009, unit: A*s^2/rad}}
force:
  - viscous_damper: {damping: {value: 0.001, unit: A*s/rad}}
"""
STEP = 0.01
TIME = STEP * np.arange(3000)


def wheel(seed: int, offset: float) -> Record:
    """The speed of a wheel of 0.0092 A s² under a current of several sines, with friction of 0.07 A and a zero of `offset`."""
    rng = np.random.default_rng(seed)
    tones = zip((0.11, 0.29, 0.7), (0.6, 0.8, 0.5), rng.uniform(0.0, 6.0, 3), strict=True)
    current = np.sum([size * np.sin(2.0 * np.pi * f * TIME + phase) for f, size, phase in tones], axis=0)
    fine, speed = 20, np.zeros(len(TIME))
    v = 0.0
    for k in range(len(TIME) - 1):
        speed[k] = v
        drive = current[k] + np.arange(fine) / fine * (current[k + 1] - current[k])
        for u in drive:
            v += STEP / fine * (u + offset - 0.0008 * v - 0.07 * np.tanh(v / 0.1)) / 0.0092
    speed[-1] = v
    speed += 0.05 * rng.standard_normal(len(TIME))
    return Record("wheel", Channel(TIME, speed, "rad/s"), Channel(TIME, current, "A"), output_kind="velocity")


@pytest.mark.parametrize(
    ("offset", "names"),
    [(0.1, {"coulomb_friction", "constant_force"}), (0.03, {"asymmetric_coulomb_friction"})],
)
def test_a_friction_and_a_larger_constant_force_are_told_as_both_and_with_a_smaller_one_as_a_friction_by_direction(
    offset, names
):
    model = Model.from_text(MODEL, catalogue=CATALOGUE)
    some = Catalogue(
        {name: CATALOGUE[name] for name in (*LAWS, "viscous_damper", "input_delay", "measurement_delay")}
    )
    answer = diagnose([wheel(1, offset)], model, [wheel(2, offset)], some).diagnosis
    assert {one.element for one in answer.missing} == names
    sizes = {one.element: one.parameters["force"].value for one in answer.missing}
    if "constant_force" in names:
        assert sizes == pytest.approx({"coulomb_friction": 0.07, "constant_force": offset}, rel=0.05)
