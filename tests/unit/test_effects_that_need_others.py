"""An effect that needs another one: a drift of a spring of which the model has none."""

from machines import CATALOGUE, SHORT, only, records
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.model import Model

MASS = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""
SPRING = {"stiffness": 200.0, "rest_length": 0.0}


def drifting(rate: float) -> Model:
    """A mass on a spring whose stiffness changes."""
    spring = Model.from_text(MASS, catalogue=CATALOGUE).with_element(CATALOGUE["linear_spring"], SPRING)
    return spring.with_element(CATALOGUE["stiffness_drift"], {"rate": rate})


def test_a_model_is_pruned_of_an_effect_and_of_what_needs_it():
    machine = drifting(0.01)
    assert [term.label for term in machine.pruned("linear_spring").terms] == ["viscous_damper"]
    assert [term.label for term in machine.pruned("stiffness_drift").terms] == [
        "viscous_damper",
        "linear_spring",
    ]


def test_a_spring_that_drifts_is_found_where_the_model_has_neither():
    runs = records(drifting(0.03), SHORT[:2], delays=(0.0, 0.0))
    found = diagnose(
        runs, Model.from_text(MASS, catalogue=CATALOGUE), catalogue=only("linear_spring", "stiffness_drift")
    )
    assert {one.element for one in found.diagnosis.missing} == {"linear_spring", "stiffness_drift"}
