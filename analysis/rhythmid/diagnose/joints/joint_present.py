"""Report of a diagnosis of several joints."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.robot_tree import parents_of
from rhythmid.diagnose.joints.joint_diagnosis import MachineAnswer
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.report.joints import JointCurves, joints_page
from rhythmid.report.page import Page
from rhythmid.report.quantity import pretty_name
from rhythmid.report.robot_figure import DrawnJoint

Array = NDArray[np.float64]


def present_machine(answer: MachineAnswer, nominal: Machine, source: str, command: str) -> Page:
    """The page of an answer; `source` names the model and the records, `command` is the command line."""
    result = answer.diagnosis.to_dict()
    models = {"Nominal machine": nominal.to_yaml(), "Augmented machine": answer.machine.to_yaml()}
    return joints_page(result, source, _robot(answer, nominal.body), _curves(answer, nominal), command, models)  # fmt: skip


def _robot(answer: MachineAnswer, body: MujocoBody) -> list[DrawnJoint]:
    found = answer.diagnosis
    faults: dict[str, str] = {}
    for one in found.missing:
        if one.joint is None:
            continue
        name = one.of_link or pretty_name(one.element)
        faults[one.joint] = f"{faults[one.joint]}, {name}" if one.joint in faults else name
    unnamed = {**dict.fromkeys(found.undecided, "undecided"), **dict.fromkeys(found.unknown, "unknown")}
    parents = parents_of(body)
    return [
        DrawnJoint(
            name,
            parents[name],
            joint.rotational,
            faults.get(name) or unnamed.get(name, ""),
            name not in faults,
        )
        for name, joint in body.joints.items()
    ]


def _curves(answer: MachineAnswer, machine: Machine) -> dict[str, JointCurves]:
    found = {}
    for joint, one in answer.results.items():
        before = answer.given.get(joint, one)
        balance = one.result.search.balance
        time = _of_first_record(balance)
        measured = balance.measured[: len(time)]
        nominal, augmented = (
            fit.fit.residual[: len(time)] for fit in (before.result.nominal, one.result.chosen)
        )
        unit = "N*m" if machine.body.joints[joint].rotational else "N"
        found[joint] = JointCurves(time, measured, measured + nominal, measured + augmented, unit)
    return found


def _of_first_record(balance: Balance) -> Array:
    """Times (n,) [s] of the rows of the first record: it may be in many stretches, such as flights between contacts."""
    first = balance.motions[0].record
    stretches = zip(balance.motions, balance.places, strict=True)
    return np.concatenate(
        [motion.time[np.asarray(places, dtype=int)] for motion, places in stretches if motion.record == first]
    )
