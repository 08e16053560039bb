"""A diagnosis in sentences."""

from dataclasses import replace

import pytest
from contests import NOMINAL, contest, decided, friction, predicted, supposed

from rhythmid.diagnose.answer.result import FitQuality, MissingEffect
from rhythmid.diagnose.answer.wording import freed_value, listed, longer_delay, summary_of
from rhythmid.diagnose.family import MissingFamily
from rhythmid.diagnose.hypothesis import Hypothesis
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.identify import paper_hopper
from rhythmid.model import Model
from rhythmid.report.quantity import in_words


def named_beside(count: int, groups: tuple[tuple[str, ...], ...] = ()) -> str:
    """What is said of friction, of so many effects beside it that are too uncertain, and of names that nothing separates."""
    _, decision = decided(contest(NOMINAL, friction(0.02)))
    decision = replace(decision, beside=("constant_force", "position_ripple")[:count], equivalent=groups)
    named = [MissingEffect("friction", "force", "", 1.0, 1.0, {})]
    return summary_of(decision, named, FitQuality(0.1, 0.1), FitQuality(0.01, 0.01), "motion")


def test_one_effect_is_and_two_are_too_uncertain_to_be_named():
    assert "With it and constant force, which is too uncertain to be named, the" in named_beside(1)
    assert "and constant force and position ripple, which are too uncertain to be named, the" in named_beside(
        2
    )


def test_names_that_are_not_separated_are_listed_with_and_and_alternatives_with_or():
    groups = (("friction", "bouc_wen"), ("a", "b", "c"))
    assert "do not separate friction and Bouc-Wen; nor a, b and c." in named_beside(0, groups)
    assert listed(("a",)) == "a" and listed(("a", "b_c", "d"), "or") == "a, b c or d" and listed(()) == ""


def test_the_summary_says_why_and_does_not_repeat_the_verdict():
    pair = [supposed(name, predicted(0.1, 700.0, seed=i)) for i, name in enumerate("ab")]
    said = summary_of(
        decided(contest(NOMINAL, *pair))[1], [], FitQuality(0.1, 0.1), FitQuality(0.1, 0.1), "motion"
    )
    assert said.startswith("The evidence does not separate several explanations. They are ")


def test_rivals_for_one_effect_are_told_with_the_effects_that_stand_beside_it():
    pair = [supposed(name, predicted(0.1, 700.0, seed=i)) for i, name in enumerate("ab")]
    decision = replace(decided(contest(NOMINAL, *pair))[1], equivalent=(("a", "b"),))
    named = [MissingEffect(name, "force", "", 0.5, 0.3, {}) for name in ("a", "flight_damping")]
    said = summary_of(decision, named, FitQuality(0.1, 0.1), FitQuality(0.1, 0.1), "motion")
    assert said.endswith("They are a or b, each beside flight damping.")


def test_where_something_else_leaves_it_undecided_rivals_are_told_beside_the_reason():
    pair = [supposed(name, predicted(0.1, 700.0, seed=i)) for i, name in enumerate("ab")]
    decision = decided(replace(contest(NOMINAL, *pair), follows=0.05))[1]
    said = summary_of(decision, [], FitQuality(0.1, 0.1), FitQuality(0.1, 0.1), "motion")
    assert said.endswith("with these effects either. These records do not separate a and b.")


def freed(*elements: str) -> Hypothesis:
    """The hypothesis that these are its effects and freed values."""
    return replace(NOMINAL, elements=elements, kind="freed_value")


@pytest.mark.parametrize(
    ("elements", "said"),
    [
        (("inertia.mass",), "is estimated at 0.3, and this predicts"),
        (("coulomb_friction", "inertia.mass"), "and this with Coulomb friction predicts"),
        (("inertia.mass", "coulomb_friction"), "and this with Coulomb friction predicts"),
        (("inertia.mass", "linear_spring.stiffness"), "0.3. linear_spring.stiffness is fixed at 200 N/m"),
    ],
)
def test_a_freed_value_is_told_wherever_it_stands_among_the_effects(elements, said):
    fitted = paper_hopper().with_element(load_catalogue()["coulomb_friction"], {"force": 0.1})
    fitted = fitted.with_values({"inertia.mass": 0.3})
    assert said in freed_value(paper_hopper(), fitted, freed(*elements))


def test_a_second_effect_whose_family_alone_is_certain_is_told_beside_the_first():
    _, decision = decided(contest(NOMINAL, friction(0.02)))
    family = MissingFamily("stiffness", ("cubic_stiffness", "bilinear_stiffness"), 0.2, 0.9)
    decision = replace(decision, families=(family,))
    named = [MissingEffect("friction", "force", "", 1.0, 1.0, {})]
    said = summary_of(decision, named, FitQuality(0.1, 0.1), FitQuality(0.01, 0.01), "motion")
    assert said.endswith(" The model lacks some form of stiffness (90 %), too; the law is undecided.")


@pytest.mark.parametrize(("unit", "told"), [("1", "fixed at 2."), ("kg", "fixed at 2 kg.")])
def test_a_pure_number_is_told_without_a_unit(unit, told):
    model = Model.from_text(
        f"units: {{mass: '{unit}', force: '{unit}*m/s^2'}}\n"
        f"inertia: {{mass: {{value: 2.0, unit: '{unit}', fixed: true}}}}\nforce: [viscous_damper: {{damping: {{value: 1.0}}}}]"
    )
    assert told in freed_value(model, model, freed("inertia.mass"))


def test_a_value_of_a_body_keeps_the_files_name_of_its_link():
    assert in_words("body.wrist_2_link.mass") == "the mass of wrist_2_link"
    assert (
        in_words("coulomb_friction, body.left.arm_1.inertia") == "Coulomb friction, the inertia of left.arm_1"
    )


def test_a_delay_that_alone_explains_the_records_is_given_in_the_summary():
    late = supposed("input_delay.delay", predicted(0.01), "delay")
    _, decision = decided(contest(NOMINAL, friction(), late))
    said = longer_delay(0.01227, 9e-6, decision)
    told = summary_of(decision, [], FitQuality(0.1, 0.1), FitQuality(0.01, 0.01), "motion", said)
    assert (
        told
        == "The input is delayed by 12.2700 ± 0.0090 ms, longer than was given, and that explains the records."
    )
    assert longer_delay(0.01227, 9e-6, decided(contest(NOMINAL, friction()))[1]) is None
