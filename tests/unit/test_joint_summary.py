"""What is said of the joints of a machine at which the records do not decide."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from answers import diagnosed

from rhythmid.diagnose.answer.compose_effort import FIXED_SCALE
from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.joints.equivalents import probability_together
from rhythmid.diagnose.joints.joint_answer import JointEffect
from rhythmid.diagnose.joints.joint_compose import COMPUTED, assumptions_of, summary_of_joints


def test_each_joint_is_told_with_its_own_rivals():
    friction = replace(diagnosed("undecided"), summary="They are Coulomb friction or Stribeck friction.")
    astray = replace(diagnosed("undecided"), summary="The refitted nominal model misses 75 % of it.")
    answers = {"hip": friction, "knee": astray, "ankle": friction, "toe": diagnosed("consistent")}
    assert summary_of_joints([], (), ("hip", "knee", "ankle"), answers, {}) == (
        "At hip, ankle the records do not decide: They are Coulomb friction or Stribeck friction. "
        "At knee the records do not decide: The refitted nominal model misses 75 % of it."
    )


def test_an_effect_that_others_replace_is_told_with_them_and_a_certain_one_alone():
    alike = (("constant_force", "linear_spring", "pendulum_gravity"),)
    answers = {"knee": replace(diagnosed("undecided"), indistinguishable=alike)}
    effect = JointEffect("knee", "constant_force", "force", "F = F₀", 0.9, 0.3, {}, 0.2, together=0.85)
    assert summary_of_joints([effect], (), (), answers, {}) == (
        "The model is wrong at knee: constant force or linear spring or pendulum gravity."
    )
    sure = replace(effect, probability=0.9)
    assert summary_of_joints([sure], (), (), answers, {}) == "The model is wrong at knee: constant force."


def test_a_name_of_low_probability_is_in_doubt_and_no_headline():
    effect = JointEffect("knee", "link_mass", "body", "m → m′", 0.9, 0.3, {}, 0.2, "shank")
    sure = JointEffect("hip", "coulomb_friction", "force", "F", 0.9, 0.95, {}, 0.2)
    answers = {"hip": diagnosed("missing_physics", "coulomb_friction"), "knee": diagnosed("undecided")}
    assert summary_of_joints([sure, effect], (), (), answers, {}) == (
        "The model is wrong at hip: Coulomb friction. In doubt: knee: the mass of shank (probability 0.30)."
    )


def test_what_leaves_most_of_an_undecided_joints_effort_is_in_doubt_however_probable():
    far = {"refitted_nominal": FitQuality(0.9, 0.89), "augmented": FitQuality(0.5, 0.46)}
    effect = JointEffect("knee", "coulomb_friction", "force", "F", 0.4, 0.9, {}, 0.2)
    answers = {"knee": replace(diagnosed("undecided"), fit=far)}
    assert summary_of_joints([effect], (), (), answers, {}) == (
        "In doubt: knee: Coulomb friction (probability 0.90)."
    )


def test_the_quantities_of_a_link_are_told_together_where_one_of_them_is_surely_wrong():
    mass = JointEffect("knee", "link_mass", "body", "m → m′", 0.9, 0.47, {}, 0.2, "shank")
    load = JointEffect("knee", "payload", "body", "point mass", 0.5, 0.46, {}, 0.1, "shank")
    answers = {"knee": diagnosed("missing_physics", "link_mass")}
    assert summary_of_joints([mass, load], (), (), answers, {"shank": ("link_mass", "payload")}) == (
        "The model is wrong at knee: the mass of shank or the payload of shank."
    )
    assert summary_of_joints([mass], (), (), answers, {"shank": ("link_mass", "link_centre_of_mass")}) == (
        "The model is wrong at knee: the mass of shank or the centre of mass of shank."
    )
    faint = replace(mass, probability=0.3)
    assert summary_of_joints([faint], (), (), answers, {"shank": ("link_mass", "payload")}) == (
        "In doubt: knee: the mass of shank (probability 0.30)."
    )


def test_names_that_are_together_improbable_are_in_doubt_whatever_they_share():
    alike = (("stribeck_friction", "coulomb_friction"),)
    answers = {"knee": replace(diagnosed("undecided"), indistinguishable=alike)}
    effect = JointEffect("knee", "stribeck_friction", "force", "F", 1.0, 0.29, {}, 0.05, together=0.55)
    assert summary_of_joints([effect], (), (), answers, {}) == (
        "In doubt: knee: Stribeck friction or Coulomb friction (probability 0.55 together)."
    )


def test_the_names_of_a_group_have_its_evidence_times_the_chance_that_they_are_laws_at_all():
    weight = {"stribeck_friction": 0.5, "coulomb_friction": 0.3, "linear_spring": 0.2}
    rivals = [SimpleNamespace(key=(one,), elements=(one,), names=(one,)) for one in weight]
    chosen = SimpleNamespace(
        elements=("stribeck_friction",), names=("stribeck_friction",), richer={}, key=("stribeck_friction",)
    )
    decision = SimpleNamespace(
        probability={"stribeck_friction": 0.4},  # 0.8 of its evidence of 0.5
        weights={(one,): held for one, held in weight.items()},
        equivalent=(("stribeck_friction", "coulomb_friction"),),
    )
    result = SimpleNamespace(
        decision=decision,
        contest=SimpleNamespace(hypotheses=rivals),
        selection=SimpleNamespace(chosen=chosen),
    )
    joint: Any = SimpleNamespace(joint="knee", result=result, rotors=())
    assert probability_together(joint, "stribeck_friction") == pytest.approx(0.8 * (0.5 + 0.3))


def test_an_effort_that_was_computed_is_not_said_to_be_recorded():
    answers = {
        joint: replace(diagnosed("consistent"), assumptions=(FIXED_SCALE,)) for joint in ("hip", "knee")
    }
    machine: Any = SimpleNamespace(body=SimpleNamespace(contacts=False))

    def said(*computed: str) -> tuple[str, ...]:
        found: Any = {joint: SimpleNamespace(by_reference=joint in computed) for joint in answers}
        return assumptions_of(machine, found, answers)

    assert said() == (FIXED_SCALE,)
    assert said("knee") == (FIXED_SCALE, COMPUTED.format("knee"))
    assert said("hip", "knee") == (COMPUTED.format("hip, knee"),)
