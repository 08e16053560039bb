"""The row of a joint agrees with what the answer of the machine states at it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from answers import diagnosed

from rhythmid.diagnose.answer.result import FitQuality
from rhythmid.diagnose.joints.joint_answer import JointEffect
from rhythmid.diagnose.joints.joint_compose import elsewhere_found, once, summary_of_joints
from rhythmid.diagnose.joints.row_agreement import agreeing

MASS = JointEffect("knee", "link_mass", "body", "m → m′", 0.9, 0.95, {}, 0.2, "shank")
DELAY = JointEffect("hip", "actuator_delay", "actuator", "f(t) → f(t − τ)", 1.0, 0.95, {}, 0.2)


@pytest.mark.parametrize(("effect", "before"), [(DELAY, "undecided"), (MASS, "consistent")])
def test_a_joint_with_a_stated_effect_lacks_physics(effect: JointEffect, before: Any):
    answers = {"hip": diagnosed("consistent"), "knee": diagnosed("consistent")}
    joint = effect.joint or ""
    answers[joint] = diagnosed(before)
    rows = agreeing(answers, [effect], {})
    assert rows[joint].verdict == "missing_physics"
    assert rows["knee" if joint == "hip" else "hip"].verdict == "consistent"
    what = "the mass of shank" if effect.link else "actuator delay"
    assert rows[joint].summary == f"The model is wrong in {what}."


def test_a_joint_where_more_is_unknown_stays_unknown():
    answers = {"knee": diagnosed("unknown_physics")}
    assert agreeing(answers, [MASS], {}) == answers


def test_a_value_of_a_link_that_several_joints_show_is_told_once_and_with_its_link():
    sides = [replace(MASS, probability=one) for one in (0.88, 0.95, 0.47)]
    assert once([DELAY, *sides]) == [DELAY, sides[1]]
    machine: Any = SimpleNamespace(body=SimpleNamespace(joint_of=lambda link: "knee"))
    open_ = [("hip", "body.shank.mass"), ("knee", "body.shank.mass")]
    assert elsewhere_found(machine, open_, [MASS]) == {"hip": ["the mass of shank"]}
    rows = agreeing(
        {"hip": diagnosed("undecided"), "knee": diagnosed("undecided")},
        [MASS],
        {"hip": ["the mass of shank"]},
    )
    assert {one.verdict for one in rows.values()} == {"missing_physics"}


def test_an_effect_that_is_sure_whatever_else_is_wrong_is_not_in_doubt():
    near = {"refitted_nominal": FitQuality(0.3, 0.32), "augmented": FitQuality(0.03, 0.03)}
    effect = JointEffect("j3", "coulomb_friction", "force", "F", 0.9, 0.98, {}, 0.3)
    answers = {"j3": replace(diagnosed("undecided"), fit=near, joint_probability=0.4)}
    assert summary_of_joints([effect], (), (), answers, {}) == (
        "Whatever else is wrong there: j3: Coulomb friction (probability 0.98)."
    )
