"""Families: the kind of physics that is missing, where the law is not decided."""

import math

import pytest
from contests import NOMINAL, contest, decided, predicted, supposed
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.diagnose.answer.result import FitQuality, MissingEffect
from rhythmid.diagnose.answer.wording import summary_of
from rhythmid.diagnose.constants import HOLDS, STATED
from rhythmid.diagnose.family import MissingFamily

FRICTION = {"coulomb": "friction", "stribeck": "friction", "spring": "stiffness", "lag": ""}
GOOD = FitQuality(0.1, 0.1)


def law(elements: str, left: float, seed: int = 0):
    """A hypothesis of these laws that leaves so much, with evidence that the seed alone sets apart from another's."""
    return supposed(elements, predicted(left, 700.0, seed=seed), family=FRICTION)


def told(*hypotheses, errors=None):
    return decided(contest(NOMINAL, *hypotheses), errors=errors)[1]


def test_of_two_laws_of_one_family_that_predict_alike_the_family_is_stated_and_neither_law():
    decision = told(law("coulomb", 0.02), law("stribeck", 0.02, seed=1))
    (one,) = decision.families
    assert decision.verdict == "undecided" and max(decision.probability.values()) < STATED
    assert one.family == "friction" and set(one.laws) == {"coulomb", "stribeck"} and one.probability >= STATED
    said = summary_of(decision, [], GOOD, GOOD, "motion")
    assert said.startswith("The model lacks some form of friction (9") and "but the law is undecided" in said


def test_a_simpler_law_that_is_chosen_is_among_the_open_ones_whatever_its_weight():
    plain = supposed(
        "coulomb", predicted(0.02, 700.0), free=6, richer={"coulomb": ("stribeck",)}, family=FRICTION
    )
    rich = supposed("stribeck", predicted(0.0199, 706.5, seed=1), free=8, family=FRICTION)
    decision = told(plain, rich)
    assert decision.named == ("coulomb",) and set(decision.families[0].laws) == {"coulomb", "stribeck"}


def test_of_two_laws_of_different_families_neither_family_is_stated():
    decision = told(law("coulomb", 0.02), law("spring", 0.02, seed=1))
    assert decision.verdict == "undecided"
    assert all(one.probability < STATED for one in decision.families)
    assert "some form of" not in summary_of(decision, [], GOOD, GOOD, "motion")


def test_a_law_whose_size_is_open_may_be_another_one_and_its_family_another_family():
    decision = told(law("coulomb", 0.02), errors={"coulomb": math.inf})
    (one,) = decision.families
    assert decision.verdict == "undecided" and decision.probability["coulomb"] <= one.probability < STATED


def test_a_law_without_a_family_is_of_none():
    assert told(law("lag", 0.02)).families == ()


@pytest.mark.parametrize("verdict", ["consistent", "unknown_physics"])
def test_a_verdict_that_no_name_stands_for_tells_no_family(verdict):
    if verdict == "consistent":
        decision = told()
    else:
        maps = {"position": predicted(0.01, 3000.0)}
        decision = decided(contest(NOMINAL, law("coulomb", 0.8), maps=maps))[1]
    assert decision.verdict == verdict and decision.families == ()


def test_a_family_of_which_a_law_is_named_is_not_told_again():
    decision = told(law("coulomb", 0.02))
    assert decision.verdict == "missing_physics" and decision.families[0].laws == ("coulomb",)
    named = [MissingEffect("coulomb", "force", "", 1.0, 0.95, {})]
    assert "some form of" not in summary_of(decision, named, GOOD, GOOD, "motion")


@settings(max_examples=30, deadline=None)
@given(st.floats(0.001, 0.9), st.floats(0.001, 0.9), st.integers(0, 5))
def test_a_family_is_at_least_as_probable_as_the_law_of_it_that_stands_alone(one, other, seed):
    decision = told(law("coulomb", one), law("stribeck", other, seed), law("spring", 0.3, seed + 1))
    for family in decision.families:
        assert isinstance(family, MissingFamily) and 0.0 <= family.probability <= HOLDS
        for label, probability in decision.probability.items():
            if FRICTION[label] == family.family:
                assert family.probability >= probability - 1e-9
