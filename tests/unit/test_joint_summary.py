"""What is said of the joints of a machine at which the records do not decide."""

from dataclasses import replace

from answers import diagnosed

from rhythmid.diagnose.joints.joint_compose import summary_of_joints


def test_each_joint_is_told_with_its_own_rivals():
    friction = replace(diagnosed("undecided"), summary="They are Coulomb friction or Stribeck friction.")
    astray = replace(diagnosed("undecided"), summary="The refitted nominal model misses 75 % of it.")
    answers = {"hip": friction, "knee": astray, "ankle": friction, "toe": diagnosed("consistent")}
    assert summary_of_joints([], (), ("hip", "knee", "ankle"), answers) == (
        "At hip, ankle the records do not decide: They are Coulomb friction or Stribeck friction. "
        "At knee the records do not decide: The refitted nominal model misses 75 % of it."
    )
