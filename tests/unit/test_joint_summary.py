"""What is said of the joints of a machine at which the records do not decide."""

from dataclasses import replace

from answers import diagnosed

from rhythmid.diagnose.joints.joint_answer import JointEffect
from rhythmid.diagnose.joints.joint_compose import summary_of_joints


def test_each_joint_is_told_with_its_own_rivals():
    friction = replace(diagnosed("undecided"), summary="They are Coulomb friction or Stribeck friction.")
    astray = replace(diagnosed("undecided"), summary="The refitted nominal model misses 75 % of it.")
    answers = {"hip": friction, "knee": astray, "ankle": friction, "toe": diagnosed("consistent")}
    assert summary_of_joints([], (), ("hip", "knee", "ankle"), answers) == (
        "At hip, ankle the records do not decide: They are Coulomb friction or Stribeck friction. "
        "At knee the records do not decide: The refitted nominal model misses 75 % of it."
    )


def test_an_effect_that_others_replace_is_told_with_them_and_a_certain_one_alone():
    alike = (("constant_force", "linear_spring", "pendulum_gravity"),)
    answers = {"knee": replace(diagnosed("undecided"), indistinguishable=alike)}
    effect = JointEffect("knee", "constant_force", "force", "F = F₀", 0.9, 0.3, {}, 0.2)
    assert summary_of_joints([effect], (), (), answers) == (
        "The model is wrong at knee: constant force or linear spring or pendulum gravity."
    )
    sure = replace(effect, probability=0.9)
    assert summary_of_joints([sure], (), (), answers) == "The model is wrong at knee: constant force."
