"""A saved model has the effects that the answer states, and no others."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from rhythmid.diagnose.joints.stated import stated_fit, stated_parameters
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model

CATALOGUE = load_catalogue()
PLAIN = Model.from_text("inertia: {mass: {value: 1.0, unit: kg}}\n", catalogue=CATALOGUE)
VALUES = {
    "coulomb_friction": {"force": 1.0},
    "linear_spring": {"stiffness": 1.0, "rest_length": 0.0},
}


@dataclass(frozen=True)
class Fit:
    model: Model


@dataclass(frozen=True)
class Found:
    elements: tuple[str, ...]
    fit: Fit
    spread: float = 0.0  # standard deviation of every parameter

    @property
    def model(self) -> Model:
        return self.fit.model

    def std(self) -> dict[str, float]:
        return dict.fromkeys(self.model.parameters, self.spread) if self.spread else {}


def found(*labels: str) -> Any:
    model = PLAIN
    for label in labels:
        model = model.with_element(CATALOGUE[label], VALUES[label])
    return Found(labels, Fit(model))


def result(chosen: Any, *others: Any) -> Any:
    search = SimpleNamespace(hypotheses=(found(), *others, chosen))
    return SimpleNamespace(chosen=chosen, nominal=found(), search=search)


def test_effects_that_are_not_stated_are_not_in_the_model_that_is_saved():
    both, alone = found("coulomb_friction", "linear_spring"), found("coulomb_friction")
    assert stated_fit(result(both, alone), ("coulomb_friction",)) is alone
    kept = stated_fit(result(both), ("coulomb_friction",))
    assert [term.label for term in kept.fit.model.terms] == ["coulomb_friction"]
    assert stated_fit(result(both, alone), ("coulomb_friction", "linear_spring")) is both
    assert stated_fit(result(both, alone), ()).elements == ()


def test_the_size_of_a_stated_law_is_not_shared_with_one_that_is_not_stated():
    """A second friction in the same fit would hold a part of the first one's force."""
    both, alone = found("coulomb_friction", "linear_spring"), found("coulomb_friction")
    both = replace(both, fit=Fit(both.model.with_values({"coulomb_friction.force": 0.7})))
    told = stated_parameters(result(both, alone), ("coulomb_friction",))
    assert told["coulomb_friction.force"].value == 1.0
    assert "linear_spring.stiffness" in told  # of the chosen hypothesis, for the joint's own answer
    assert stated_parameters(result(both, alone), ())["coulomb_friction.force"].value == 0.7


def test_a_stated_size_has_the_uncertainty_that_the_chosen_hypothesis_has_beyond_its_fit():
    """The choice of the model and small effects that it lacks."""
    fitted = replace(found("coulomb_friction", "linear_spring"), spread=0.03)
    alone = replace(found("coulomb_friction"), spread=0.04)
    search = SimpleNamespace(hypotheses=(found(), alone, fitted))
    known: Any = SimpleNamespace(chosen=replace(fitted, spread=0.05), nominal=found(), search=search)
    told = stated_parameters(known, ("coulomb_friction",))
    assert told["coulomb_friction.force"].std == pytest.approx(math.hypot(0.04, 0.04))
    assert told["linear_spring.stiffness"].std == 0.05
    both = stated_parameters(known, ("coulomb_friction", "linear_spring"))
    assert both["coulomb_friction.force"].std == 0.05
