"""Drafts signals.yaml and model.yaml of a machine with several joints from recordings of a robot and its MJCF or
URDF file.

Among the families of channels, the one with measured positions is the output. Measured forces are the effort, and
commanded positions the references.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rhythmid.body.machine import FIXED, KINDS, TRANSITION, Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.record.inventory import Inventory, header_clock, inventory
from rhythmid.record.joint_record import JointSignals, load_joint_records
from rhythmid.start.drivers import not_read
from rhythmid.start.families import GENERIC, Family, families_of, joints_of, with_constants
from rhythmid.start.first_gains import first_gains
from rhythmid.start.leading_family import leading_family
from rhythmid.start.meaning import says_it_was_read
from rhythmid.start.passive_joints import base_channel, base_of, unused, without_passive
from rhythmid.start.unnamed_families import HOW, unnamed_families, without_names
from rhythmid.start.unsigned_effort import unsigned_family
from rhythmid.start.vocabulary import ELECTRICAL, WORDS, Quantity
from rhythmid.start.words import words_of
from rhythmid.start.yaml_text import GUESSED, as_guessed, comment, time_of

# words that name a current, and those that name a force, also one that was computed from a current
CURRENTS = frozenset(ELECTRICAL["A"].split()) | {"ampere", "amperes"}
OF_FORCE = WORDS["effort"] - frozenset(" ".join(ELECTRICAL.values()).split())
LITTLE = 0.02  # share of the effort assigned to viscous damping as a first guess
# first guess for a controller with unknown gains: this frequency [Hz] and damping ratio with the inertia of the joint
STIFF, DAMPED = 3.0, 0.7


@dataclass(frozen=True, eq=False)
class RobotStart:
    """The texts of both files, and the guesses in plain text, one line each."""

    signals: str
    model: str
    told: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The guesses as plain values for JSON."""
        return {"roles": list(self.told), "doubts": list(self.doubts)}

    def lines(self) -> list[str]:
        """The guesses in plain text, one line each."""
        return [*self.told, *(f"CHECK {doubt}" for doubt in self.doubts)]


def start_robot(
    sources: Sequence[str | Path], body: Path, out: Path, rate: float | None, catalogue: Catalogue
) -> RobotStart:
    """Inspect recordings of a robot and guess the channels of its joints.

    Parameters
    ----------
    sources : bags or tables of one layout.
    body : the robot's MJCF (.xml) or URDF file.
    out : folder for the files; the model names the robot's file relative to it.
    rate : of a table without a time [Hz].

    Raises InputError, one line, where no position of a joint of the robot was recorded, or neither an effort nor a
    reference.
    """
    robot = MujocoBody.load(body, contacts=False)
    found = inventory(sources[0], rate)
    nameless = without_names(found)
    families = unnamed_families(found) if nameless else list(families_of(found, list(robot.joints)))
    output = _chosen(families, "position", False, robot)
    if output is None and nameless:
        raise InputError(f"{found.path}: no measured position of a joint of {body.name} is found: {HOW}")
    if output is None:
        raise InputError(
            f"{found.path}: no measured position of a joint of {body.name} is among {', '.join(map(str, found.recorded))}; "
            f"its joints: {', '.join(robot.joints)}"
        )
    families = [one if one is output else with_constants(one, found, output.members) for one in families]
    whole, (output, idle) = output, without_passive(families, output)
    families = [output if one is whole else one for one in families]
    base = base_of(str(found.path), robot, families, replace(output, members=whole.members), idle)
    joints = joints_of(list(robot.joints), list(output.members), output.told)
    reference, of_reference = _beside(families, "position", True, output), list[str]()
    if reference is None:
        output, reference, of_reference = leading_family(families, output)
    effort, others, unsigned = _effort(families, output, reference)
    command = _beside(families, "effort", True, output)
    forward = command if reference is not None else None
    if effort is None and reference is None:
        effort = command
    if effort is None and reference is None:
        raise InputError(
            f"{found.path}: neither efforts nor references of {', '.join(output.members)} are among "
            f"{', '.join(one.pattern for one in families)}{_other_numbers(families, output)}{'; '.join(['', *unsigned])}"
        )
    told = [_line("output", output, found.is_bag, joints)]
    told += [
        _line(role, one, found.is_bag, joints)
        for role, one in (("effort", effort), ("input", reference))
        if one
    ]
    of_effort = [*unsigned, *_doubts_of_effort(effort, others, command)]
    signals, doubts = _signals(found, joints, output, effort, reference, forward, of_effort, of_reference)
    signals += f"\n{base_channel(base[1])}\n" if base is not None else ""
    with as_guessed():
        records = load_joint_records(sources, JointSignals.from_text(signals, GUESSED))
    speeds = {
        name: float(np.std(np.gradient(one.output.value, one.output.time)))
        for name, one in records[0].joints.items()
    }
    sizes = {
        name: float(np.std(one.effort.value)) if one.effort else 0.0
        for name, one in records[0].joints.items()
    }
    gains = {name: first_gains(one) for name, one in records[0].joints.items()}
    moved = base[0] if base is not None else None
    known = robot, body, joints, speeds, sizes, gains if reference is not None else None, moved
    Machine.from_text(_model(str(body.resolve()), *known), Path(), catalogue)  # `out` need not exist yet
    model = _model(os.path.relpath(body.resolve(), out.resolve()), *known)
    held = [name for name in robot.joints if name not in joints and name != moved]
    doubts += [f"held at zero, because not recorded: {', '.join(held)}"] if held else []
    doubts += [
        f"{joint} is held at zero, but {names} may be its position; it is not used"
        for joint, names in unused(families, held).items()
    ]
    if moved is not None:
        doubts.append(
            f"base: nothing that was recorded drives {moved}, which moves all others; it is taken for the base's joint"
        )
    doubts += list(robot.notes)
    return RobotStart(signals, model, tuple(told), tuple(doubts))


def _chosen(
    families: Sequence[Family], quantity: Quantity, commanded: bool, robot: MujocoBody
) -> Family | None:
    """The family of this quantity with the most joints of the robot."""
    fits = [
        (len(matched), one)
        for one in families
        if one.quantity == quantity and one.commanded == commanded
        and (matched := joints_of(list(robot.joints), list(one.members), one.told))
    ]  # fmt: skip
    return max(fits, key=lambda each: each[0], default=(0, None))[1]


def _beside(families: Sequence[Family], quantity: Quantity, commanded: bool, output: Family) -> Family | None:
    """The first family of this quantity with all joints of the output; a command without a stated quantity is a
    position."""
    return next(_all_beside(families, quantity, commanded, output), None)


def _all_beside(
    families: Sequence[Family], quantity: Quantity, commanded: bool, output: Family
) -> Iterator[Family]:
    of = (quantity, None) if commanded and quantity == "position" else (quantity,)
    yield from (
        one
        for one in families
        if one is not output and one.quantity in of and one.commanded == commanded
        and set(one.members) >= set(output.members)
    )  # fmt: skip


def _effort(
    families: Sequence[Family], output: Family, reference: Family | None
) -> tuple[Family | None, list[Family], list[str]]:
    """The effort that was not commanded, preferably a force and a sensor reading, not a current; the other efforts; and
    a note on each effort without its sign. A force that never acts at any joint gives way to a current."""
    able = sorted(
        _all_beside(families, "effort", False, output),
        key=lambda one: (_idle(one), _is_current(one), not says_it_was_read(one.first)),
    )
    references = [reference] if reference is not None else []
    notes = {one.pattern: unsigned_family(one, output, references) for one in able}
    able = [one for one in able if not notes[one.pattern]]
    return (able[0] if able else None), able[1:], [note for note in notes.values() if note]


def _idle(family: Family) -> bool:
    """Whether no effort of a family ever acts."""
    return not any(np.any(one.value) for one in family.members.values())


def _is_current(family: Family) -> bool:
    """Whether a family is called a current, or is in amperes."""
    words = set(words_of(family.pattern))
    return family.first.unit == "A" or bool(CURRENTS & words and not OF_FORCE & words)


def _other_numbers(families: Sequence[Family], output: Family) -> str:
    """How to go on where efforts or references of as many joints have other numbers than the positions."""
    those = [
        one
        for one in families
        if one is not output and not one.told and len(one.members) == len(output.members)
        and (one.quantity == "effort" or one.commanded)
    ]  # fmt: skip
    if output.told or not those:
        return ""
    first = ", ".join(f"{one.pattern} from {min(one.members, key=int)}" for one in those)
    return (
        f": {output.pattern} is numbered from {min(output.members, key=int)}, {first}; give the columns of one joint one number, "
        "in the table's heading"
    )


def _doubts_of_effort(effort: Family | None, others: Sequence[Family], command: Family | None) -> list[str]:
    """Doubts about the choice among several efforts."""
    if effort is None:
        return []
    if effort is command:
        return [
            "effort: no other one was recorded than what the actuators were asked for, which they may not have made"
        ]
    doubts: list[str] = []
    if still := [name for name, one in effort.members.items() if not np.any(one.value)]:
        doubts.append(
            f"effort: that of {', '.join(still)} is always 0, as where no motor acts; where one acts whose effort was not "
            "recorded, nothing that is said of these joints holds"
        )
    if effort.meaning is not None:
        doubts.append(
            f"effort: no name says that {effort.pattern} are efforts, nor their unit; where they are in A, give them the torque or force of one "
            "ampere at each joint, such as  scale: {JOINT: 10}"
        )
    elif not effort.first.unit and _is_current(effort):
        doubts.append(
            f"effort: {effort.pattern} is called a current; where it is in A, give it the torque or force of one ampere at each joint, such as  "
            "scale: {JOINT: 10}"
        )
    if others:
        listed = [one.pattern for one in others]
        why = not_read(listed) if says_it_was_read(effort.first) else f"{', '.join(listed)} may be it as well"
        doubts.append(f"effort: {why}")
    if command is not None:
        doubts.append(
            f"effort: {command.pattern} is what the actuators were asked for; {effort.pattern} is taken, because the balance of forces needs "
            "what they made"
        )
    return doubts


def _line(role: str, one: Family, bag: bool, joints: Mapping[str, str]) -> str:
    where = f"{one.topic} {one.pattern}" if bag else one.pattern
    return f"{role}: {where} of {len(joints)} joints: {one.said.reason or 'the only one left'}"


def _signals(
    found: Inventory,
    joints: Mapping[str, str],
    output: Family,
    effort: Family | None,
    reference: Family | None,
    forward: Family | None,
    of_effort: Sequence[str],
    of_reference: Sequence[str],
) -> tuple[str, list[str]]:
    """The text of signals.yaml, and doubts about it."""
    bag, doubts = found.is_bag, list[str]()
    chosen = {"output": output.first} | ({"input": reference.first} if reference else {})
    clock, reason = header_clock(chosen) if bag else (found.clock, found.clock_reason)
    alike = {frozenset(words_of(one)) - GENERIC for one in joints}
    if output.told and any(frozenset(words_of(one)) - GENERIC not in alike for one in joints.values()):
        doubts.append(
            "joints: the recording has other names than the robot's file; they are matched by what differs among them"
        )
    if output.meaning is not None:
        doubts.append(
            f"output: no name says that {output.pattern} are positions; they are taken for them, because the columns after them are their slopes"
        )
    if not output.told:
        doubts.append(
            "joints: they are numbered in the recording; their order is taken to be that of the robot's file"
        )
    lines = [
        *comment(f"Which channels of {found.path.name} are those of the robot's joints. Guessed by `rhythmid init`: look through it and correct what is wrong."),
        "", *(line for doubt in doubts for line in comment(f"CHECK {doubt}.")),
        f"joints: {_names(joints, output)}",
        "", *comment(f"time: {reason}."), f"time: {time_of(clock)}",
        "", f"output: {{{output.channel(bag)}}}",
    ]  # fmt: skip
    if reference is not None:
        extra = (
            f", feedforward: {json.dumps(forward.pattern)}"
            if forward is not None and forward.topic == reference.topic
            else ""
        )
        doubts += of_reference
        lines += [
            "", *(line for doubt in of_reference for line in comment(f"CHECK {doubt}.")),
            *comment("what the robot's controllers are asked for."),
            f"input: {{{reference.channel(bag)}, kind: reference{extra}}}",
        ]  # fmt: skip
    elif of_reference:
        doubts += of_reference
        lines += ["", *(line for doubt in of_reference for line in comment(f"CHECK {doubt}."))]
    if effort is None:
        doubts += of_effort
        lines += [line for doubt in of_effort for line in comment(f"CHECK {doubt}.")]
    else:
        doubts.append(
            "effort: nothing says whether it was recorded before the actuator or at the joint, and as a mean or at an instant"
        )
        doubts += of_effort
        lines += [
            "", *(line for doubt in of_effort for line in comment(f"CHECK {doubt}.")),
            *comment("taken: after_actuator where a sensor at the joint measures it. sampled: mean, or instant where it was read when the reference jumps."),
            f"effort: {{{effort.channel(bag)}, taken: before_actuator}}",
        ]  # fmt: skip
    return "\n".join(lines) + "\n", doubts


def _names(joints: Mapping[str, str], output: Family) -> str:
    """The robot's joints, with their names in the recording where these differ."""
    # entries of an array and columns without names are identified by their place in the list
    by_place = not output.told and (output.pattern.endswith("[*]") or output.meaning is not None)
    if by_place or all(joint == name for joint, name in joints.items()):
        return f"[{', '.join(joints)}]"
    return f"{{{', '.join(f'{joint}: {json.dumps(name)}' for joint, name in joints.items())}}}"


def _model(
    place: str,
    robot: MujocoBody,
    path: Path,
    joints: Mapping[str, str],
    speeds: Mapping[str, float],
    efforts: Mapping[str, float],
    gains: Mapping[str, tuple[float, float, float] | None] | None,
    base: str | None,
) -> str:
    """The text of model.yaml; `gains` are those of the controllers that the record determines, None without references."""
    kind = KINDS[1] if path.suffix.lower() == ".urdf" else KINDS[0]
    hold = [name for name in robot.joints if name not in joints and name != base]
    free = ", ".join(f"{joint}.armature: {{}}" for joint in joints)
    lines = [
        *comment("A nominal model to begin with, made by `rhythmid init` of the robot's file: all values below are first guesses and are estimated."),
        "", *comment("free: the inertia of each rotor, which such files seldom have."),
        "body:", f"  {kind}: {json.dumps(place)}", f"  base: {base or FIXED}",
        *(comment("  CHECK contacts: true where the robot touches the ground.") if base else ()), "  contacts: false",
    ]  # fmt: skip
    if hold:
        lines.append(f"  hold: [{', '.join(hold)}]")
    lines += [f"  free: {{{free}}}", "joints:"]
    if gains is not None:
        lines += _said_of_gains(gains)
    for joint in joints:
        lines.append(f"  {joint}:")
        inertia = robot.effective_inertia(joint)
        if gains is not None:
            known = gains[joint]
            stiffness = known[0] if known else inertia * (2.0 * np.pi * STIFF) ** 2
            damping = known[1] if known else 2.0 * DAMPED * np.sqrt(inertia * stiffness)
            lines.append(
                f"    command: [{{position_control: {{proportional: {stiffness:.3g}, derivative: {damping:.3g}}}}}]"
            )
        guess = robot.passive[joint].damping or LITTLE * (efforts[joint] or inertia) / max(
            speeds[joint], 1e-9
        )
        dry = robot.passive[joint].friction
        rubs = (
            f", {{coulomb_friction: {{force: {dry:.3g}, transition: {TRANSITION:g}}}}}" if dry > 0.0 else ""
        )
        lines.append(f"    force: [{{viscous_damper: {{damping: {guess:.3g}}}}}{rubs}]")
    return "\n".join(lines) + "\n"


def _said_of_gains(gains: Mapping[str, tuple[float, float, float] | None]) -> list[str]:
    """What is known of the controllers' gains, as comments."""
    told = {joint: f"{one[2]:.0%} at {joint}" for joint, one in gains.items() if one is not None}
    lines: list[str] = []
    if told:
        lines += comment(
            f"  CHECK position_control: gains by least squares of reference, position and effort, of which they explain {', '.join(told.values())}; put in those that are known."
        )
    if len(told) < len(gains):
        of = f" at {', '.join(joint for joint in gains if joint not in told)}" if told else ""
        lines += comment(
            f"  CHECK position_control: the records do not determine the gains of the robot's controllers{of}. Without an effort, forces have their scale from them."
        )
    return lines
