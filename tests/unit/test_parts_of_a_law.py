"""A friction beside a constant force that is larger: no friction by direction, which would push one way, is both."""

import numpy as np
import pytest

from machines import CATALOGUE
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.diagnose.search.proposals import in_parts
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.diagnose.search.trial import Trial
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.noise import NoiseModel
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


@pytest.mark.parametrize(
    ("asymmetry", "scored", "parts"),
    [
        (1.0, LAWS[1:], ("constant_force", "coulomb_friction")), (0.6, LAWS[1:], ()),
        (-1.0, LAWS[1:2], ()),  # a constant force is in the model, or a rest length does the same
    ],
)  # fmt: skip
def test_parts_are_refitted_from_their_sizes_where_a_law_ends_and_all_of_them_are_candidates(
    asymmetry, scored, parts
):
    model = Model.from_text(MODEL, catalogue=CATALOGUE)
    law = model.with_element(CATALOGUE[LAWS[0]], {"force": 0.08, "asymmetry": asymmetry, "transition": 0.3})
    quiet = NoiseModel(np.empty(0), 1.0)
    here = Trial((), model, (), 1e4, 2000, 2, True, quiet)
    ended = Trial(LAWS[:1], law.with_values({"viscous_damper.damping": 2e-4}), (), 1e3, 2000, 5, True, quiet)
    values = {"force": 0.02, "transition": 1.0}
    scores = [
        Score(CATALOGUE[name], {p.name: values[p.name] for p in CATALOGUE[name].parameters}, 9.0, 1.0)
        for name in scored
    ]
    made = list(in_parts(here, Round(tuple(scores), 0.0), [ended]))
    assert [one.added for one in made] == ([parts] if parts else [])
    for one in made:
        assert one.model.value("constant_force.force") == pytest.approx(-0.08)
        begun = {
            "coulomb_friction.force": 0.08,
            "coulomb_friction.transition": 0.3,
            "viscous_damper.damping": 2e-4,
        }
        assert begun.items() <= dict(one.guesses[0]).items()
