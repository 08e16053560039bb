"""A payload of an arm that hardly moves: at each joint it looks like a constant force, at both together only like itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from legged import recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.joints.joint_case import JointResult, diagnose_joint
from rhythmid.diagnose.joints.joint_diagnosis import stated_at
from rhythmid.diagnose.joints.shared_cause import contradicted, shared_cause
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.joints.joint_motion import JointBalances

ARM = """<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
    <inertia ixx="0.03" iyy="0.03" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 -0.15"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.012" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="one" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
  <joint name="two" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
</robot>
"""
PATH = (
    "{command: [{input_delay: {delay: 0.0}}, {position_control: {proportional: {value: 80, fixed: true}, "
    "derivative: {value: 2.0, fixed: true}}}], force: [{viscous_damper: {damping: 0.1}}]}"
)
CARRIED, PAYLOAD = 0.1, "lower.payload"  # kg


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    folder: Path = tmp_path_factory.mktemp("two")
    (folder / "two.urdf").write_text(ARM)
    (folder / "two.yaml").write_text(
        f"body: {{urdf: two.urdf, contacts: false}}\njoints:\n  one: {PATH}\n  two: {PATH}\n"
    )
    return Machine.load(folder / "two.yaml")


def searched(plant: Machine, nominal: Machine) -> tuple[JointBalances, dict[str, JointResult]]:
    """What is found at each joint alone."""
    time, rng = np.arange(0.0, 5.0, 0.002), np.random.default_rng(4)
    asked = references({"one": (0.5, 0.01), "two": (0.7, 0.01)}, time, rng, (0.3, 2.0))
    balances = JointBalances.of(nominal, [recorded(plant, asked, time, rng)])
    known, budget = load_catalogue(), Budget(None)
    return balances, {
        joint: diagnose_joint(balances, None, joint, known, lambda _: None, budget)
        for joint in nominal.joints
    }


@pytest.fixture(scope="module")
def carrying(arm: Machine) -> tuple[JointBalances, dict[str, JointResult]]:
    return searched(arm.with_inertial({"lower.payload": CARRIED}), arm)


@pytest.fixture(scope="module")
def leaning(arm: Machine) -> tuple[JointBalances, dict[str, JointResult]]:
    """A constant force at either joint, as no payload makes them."""
    constant = load_catalogue()["constant_force"]
    plant = arm.with_element("one", constant, {"force": 0.4}).with_element("two", constant, {"force": -0.3})
    return searched(plant, arm)


def choosing(found: dict[str, JointResult], *elements: str) -> dict[str, JointResult]:
    """The results as if these elements alone had been chosen at every joint."""
    made = {}
    for joint, one in found.items():
        fitted = next(f for f in one.result.search.hypotheses if f.elements == elements)
        made[joint] = replace(one, result=replace(one.result, chosen=fitted))
    return made


def test_one_payload_explains_what_constant_forces_of_all_joints_do(carrying):
    balances, found = carrying
    stated = dict.fromkeys(found, ("constant_force",))
    cause = shared_cause(balances, choosing(found, "constant_force"), stated, ())
    assert cause is not None and cause.parameter == PAYLOAD and cause.evidence > 0.0
    (label,) = cause.shown.result.decision.named
    assert label == f"body.{PAYLOAD}" and cause.shown.result.decision.probability[label] > 0.8
    assert cause.shown.result.chosen.model.value(label) == pytest.approx(CARRIED, rel=0.15)


def test_constant_forces_that_no_payload_makes_stay_what_they_are(leaning):
    balances, found = leaning
    stated = {joint: stated_at(one) for joint, one in found.items()}
    assert stated == {"one": ("constant_force",), "two": ("constant_force",)}
    assert shared_cause(balances, found, stated, ()) is None


def test_a_payload_that_one_joint_sees_and_the_others_contradict_is_none(leaning, carrying):
    for (balances, found), wrong in ((leaning, True), (carrying, False)):
        shown = choosing({"two": found["two"]}, f"body.{PAYLOAD}")["two"]
        assert contradicted(balances, found, PAYLOAD, shown) is wrong
