"""Orientations, places of tools and numbered joints in one table."""

import numpy as np

from rhythmid.start.start import guess


def table(folder, names, columns):
    time = np.arange(0.0, 10.0, 0.01)
    made = np.column_stack([time, *(law(time) for law in columns)])
    np.savetxt(folder / "run.csv", made, delimiter=",", header=",".join(["time", *names]), comments="")
    return folder / "run.csv"


def turn(time):
    return 0.3 * np.sin(1.3 * time)


QUATERNION = (lambda t: np.sin(turn(t)), lambda t: 0.0 * t, lambda t: 0.0 * t, lambda t: np.cos(turn(t)))
JOINTS = (lambda t: 0.5 * np.sin(2.0 * t), lambda t: 0.3 * np.sin(1.3 * t + 0.4))
PLACE = (lambda t: 2.0 * np.sin(2.0 * t), lambda t: np.cos(2.0 * t), lambda t: np.sin(1.3 * t))


def test_numbered_joints_are_positions_and_neither_a_tool_nor_its_orientation_drives_them(tmp_path):
    names = ["x", "y", "z", "qx", "qy", "qz", "qw", "j0", "j1"]
    found = guess(table(tmp_path, names, (*PLACE, *QUATERNION, *JOINTS)))
    assert found.roles.choices["output"].recorded.column == "j0"
    assert set(found.roles.choices) == {"output"} and found.roles.joint.others == ["1"]
    assert any("quaternion" in why for why in found.inventory.left_out)


def test_a_place_without_joints_is_a_motion_and_letters_that_are_no_quaternion_stay(tmp_path):
    found = guess(table(tmp_path, ["x", "qx", "qy", "qz", "qw"], (PLACE[0], *QUATERNION)))
    assert found.roles.choices["output"].recorded.column == "x" and len(found.roles.choices) == 1
    found = guess(table(tmp_path, ["qx", "qy", "qz", "qw"], (*PLACE, JOINTS[0])))
    assert not any("quaternion" in why for why in found.inventory.left_out)


def test_a_joint_with_a_word_for_another_quantity_keeps_it(tmp_path):
    found = guess(
        table(tmp_path, ["joint1", "joint2", "joint1_torque", "joint2_torque"], (*JOINTS, *PLACE[:2]))
    )
    assert found.roles.choices["output"].recorded.column == "joint1"
    assert {role: one.recorded.column for role, one in found.roles.choices.items() if role != "output"}.get(
        "input", "joint1_torque"
    ) == "joint1_torque"
