"""Joints whose motors turn with both of them: what is missing at one goes with the motion of the other."""

from dataclasses import replace

import numpy as np
from legged import fixed_leg, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.record.joint_record import JointRecord

MIDDLES = {"hip": (0.4, 0.3), "knee": (-1.2, 0.3)}
TIME = np.arange(0.0, 12.0, 0.002)
FRICTION = 0.6  # N*m, of the motor that turns with the sum of both speeds


def coupled(record: JointRecord) -> JointRecord:
    """The record as if the knee's motor had dry friction and turned with the sum of both joints' speeds."""
    hip, knee = record.joints["hip"], record.joints["knee"]
    assert knee.effort is not None
    time = knee.effort.time
    both = np.interp(time, hip.output.time, hip.output.value) + np.interp(
        time, knee.output.time, knee.output.value
    )
    speed = np.convolve(np.gradient(both, time), np.ones(15) / 15, "same")
    effort = knee.effort.value + FRICTION * np.tanh(speed / 0.05)
    return replace(
        record, joints={"hip": hip, "knee": replace(knee, effort=replace(knee.effort, value=effort))}
    )


def test_the_answer_of_a_joint_names_the_records_that_were_held_out(tmp_path):
    machine, rng, time = Machine.load(fixed_leg(tmp_path)), np.random.default_rng(2), TIME[:2000]
    seen, unseen = (
        recorded(machine, references(MIDDLES, time, rng, (0.4, 4.0)), time, rng) for _ in range(2)
    )
    laws = Catalogue({name: one for name, one in load_catalogue().items() if name == "viscous_damper"})
    found = diagnose_machine([seen], machine, [replace(unseen, name="later")], catalogue=laws).diagnosis
    assert {one.heldout for one in found.joints.values()} == {"held out: later"}


def test_a_friction_that_turns_with_two_joints_is_unknown_physics_that_depends_on_the_other_one(tmp_path):
    machine = Machine.load(fixed_leg(tmp_path))
    rng = np.random.default_rng(8)
    record = recorded(machine, references(MIDDLES, TIME, rng, (0.4, 4.0)), TIME, rng)
    plain = diagnose_machine([record], machine).diagnosis
    assert {one.verdict for one in plain.joints.values()} == {"consistent"}
    found = diagnose_machine([coupled(record)], machine).diagnosis
    assert found.joints["hip"].verdict == "consistent"
    knee = found.joints["knee"]
    assert knee.verdict == "unknown_physics" and knee.remainder.goes_with == "the velocity of hip"
    assert (
        "At knee something is missing" in found.summary and "depends on the velocity of hip" in found.summary
    )
