"""Joints that were recorded under each other's names."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from legged import MODELS, fixed_leg, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.joints.joint_order import check_order
from rhythmid.record.joint_record import JointRecord


def played(machine: Machine, asked: dict[str, tuple[float, float]], seconds: float) -> JointRecord:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, seconds, 0.002)
    return recorded(machine, references(asked, time, rng, (0.5, 4.0)), time, rng)


def exchanged(record: JointRecord, **names: str) -> JointRecord:
    """The record with joints under other names."""
    return replace(record, joints={joint: record.joints[names.get(joint, joint)] for joint in record.joints})


def test_exchanged_joints_are_named_and_the_right_order_is_not_refused(tmp_path: Path):
    machine = Machine.load(fixed_leg(tmp_path))
    record = played(machine, {"hip": (0.6, 0.3), "knee": (-1.2, 0.3)}, 6.0)
    with pytest.raises(InputError, match="hip is recorded as knee, knee is recorded as hip") as caught:
        identify_machine([exchanged(record, hip="knee", knee="hip")], machine)
    assert "\n" not in str(caught.value)
    check_order(JointBalances.of(machine, [record]))
    rough = machine.with_element(
        "knee", load_catalogue()["coulomb_friction"], {"force": 0.5, "transition": 0.02}
    )
    check_order(JointBalances.of(machine, [played(rough, {"hip": (0.6, 0.3), "knee": (-1.2, 0.3)}, 6.0)]))


def test_of_an_arms_six_joints_the_order_is_found():
    machine = Machine.load(MODELS / "arm.yaml")
    asked = {joint: (float(machine.body.reference[k]), 0.2) for k, joint in enumerate(machine.joints)}
    record = played(machine, asked, 3.0)
    wrong = exchanged(record, joint2="joint3", joint3="joint5", joint5="joint2")
    with pytest.raises(InputError, match="joint2 is recorded as joint5"):
        check_order(JointBalances.of(machine, [wrong]))
