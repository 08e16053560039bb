"""The robot as its joints in a report."""

import xml.etree.ElementTree as tree
from types import SimpleNamespace

import numpy as np
import pytest
from legged import MODELS

from rhythmid.body.machine import Machine
from rhythmid.body.robot_tree import parents_of
from rhythmid.diagnose.joints.joint_present import _of_first_record
from rhythmid.report.robot_figure import DrawnJoint, robot_svg


def test_a_quadruped_has_four_chains_of_three_and_its_faulty_joint_is_marked():
    body = Machine.load(MODELS / "quadruped.yaml").body
    parents = parents_of(body)
    assert sum(parent is None for parent in parents.values()) == 4
    robot = [
        DrawnJoint(name, parents[name], True, "backlash <1>" if name == list(parents)[2] else "")
        for name in parents
    ]
    root = tree.fromstring(robot_svg(robot, "a <quadruped>"))
    shapes = [one.get("class") for one in root.iter() if one.tag.endswith("circle")]
    assert shapes.count("slot faulty") == 1 and shapes.count("slot") == 11
    texts = [one.text for one in root.iter() if one.tag.endswith("text")]
    assert "backlash <1>" in texts and texts.count("!") == 1
    places = {(one.get("cx"), one.get("cy")) for one in root.iter() if one.tag.endswith("circle")}
    assert len(places) == 12


def test_what_slides_is_a_square_and_what_has_no_name_a_question():
    leg = Machine.load(MODELS / "leg.yaml").body
    assert parents_of(leg) == {"rail": None, "hip": "rail", "knee": "hip"}
    joints = [DrawnJoint("rail", None, False), DrawnJoint("hip", "rail", True, "unknown", True)]
    drawn = robot_svg(joints, "a leg")
    assert drawn.count("<circle") == 1 and ">?<" in drawn


def test_efforts_are_drawn_over_all_stretches_of_the_first_record():
    stretches = [
        SimpleNamespace(record=record, time=begin + 0.01 * np.arange(5))
        for record, begin in ((0, 0.0), (0, 1.0), (1, 3.0))
    ]
    balance = SimpleNamespace(motions=stretches, places=(np.array([0, 2]), np.array([1]), np.array([3])))
    assert _of_first_record(balance) == pytest.approx([0.0, 0.02, 1.01])
