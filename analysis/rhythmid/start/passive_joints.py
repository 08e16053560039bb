"""Joints of a robot that were recorded without an effort or a reference: that of a base that moves, which nothing drives."""

import json
from collections.abc import Sequence
from dataclasses import replace

from rhythmid.body.carrier import carries_all
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.errors import InputError
from rhythmid.record.inventory import Recorded
from rhythmid.start.families import Family, joints_of


def without_passive(families: Sequence[Family], output: Family) -> tuple[Family, list[str]]:
    """The positions of the joints that have an effort or a reference, and the names of the other joints in the recording; all where none has.

    Joints that are only numbered all stay.
    """
    driven = {
        joint
        for one in families
        if one is not output and one.told and (one.quantity == "effort" or one.commanded)
        for joint in one.members
    } & set(output.members)
    if not output.told or not driven:
        return output, []
    idle = [joint for joint in output.members if joint not in driven]
    return replace(
        output, members={name: output.members[name] for name in output.members if name in driven}
    ), idle


def base_of(
    path: str, robot: MujocoBody, families: Sequence[Family], output: Family, idle: Sequence[str]
) -> tuple[str, Recorded] | None:
    """The joint along which the base moves, and its recorded position; None where the positions of no undriven joint were recorded.

    `output` are all measured positions, of which those of `idle` joints in the recording have neither effort nor reference. Raises InputError
    where one of these is no joint between the world and the rest of the robot.
    """
    joints = list(robot.joints)
    known = {name: output.members[name] for name in idle}
    for one in families:
        if one is not output and one.told and one.quantity == "position" and not one.commanded:
            known |= {name: member for name, member in one.members.items() if name not in output.members}
    found = (
        {joint: known[name] for joint, name in joints_of(joints, list(known), True).items()} if known else {}
    )
    bases = [joint for joint in found if carries_all(robot.model, joint)]
    if len(bases) == 1:
        return bases[0], found[bases[0]]
    if idle:
        raise InputError(
            f"{path}: neither efforts nor references of {', '.join(idle)} were recorded, only positions; where no motor acts, add a column of "
            "zeros as the effort, named as those of the other joints"
        )
    return None


def base_channel(one: Recorded) -> str:
    """The channel of the base in the notation of signals.yaml."""
    where = (
        f"topic: {one.topic}, field: {json.dumps(one.field)}"
        if one.topic
        else f"column: {json.dumps(one.column)}"
    )
    unit = f", unit: {json.dumps(one.unit)}" if one.unit else ""
    scale = "" if one.scale == 1.0 else f", scale: {one.scale:.10g}"
    return f"base: {{{where}{unit}{scale}}}"


def unused(families: Sequence[Family], held: Sequence[str]) -> dict[str, str]:
    """Names of the recorded numbers of each held joint that may be its position and are not used."""
    found: dict[str, list[str]] = {}
    for one in families:
        if one.told and one.quantity in ("position", None):
            for joint, name in joints_of(list(held), list(one.members), True).items():
                found.setdefault(joint, []).append(str(one.members[name]))
    return {joint: ", ".join(dict.fromkeys(names)) for joint, names in found.items()}
