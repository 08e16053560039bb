"""Orientations as quaternions, and the numbers of joints beside them: `ee.qx` to `ee.qw` are no motions by themselves, `j0`
to `j6` are the positions of joints, and `x`, `y`, `z` beside both the place of a tool, which the joints move."""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.start.role_choice import Known

COMPONENT = re.compile(r"(.*?)(?:q|quat|ori|orientation|rotation|rot)[._ ]?([xyzw])", re.IGNORECASE)
UNIT_LENGTH = 0.01  # by which the length of a quaternion may differ from one
MOSTLY = 0.99  # share of rows in which it must not
NUMBERED = re.compile(r"(?:.*[._/])?(?:j|jnt|joint)_?(\d+)", re.IGNORECASE)
FEWEST_JOINTS = 2


def without_quaternions(found: Inventory) -> Inventory:
    """The inventory without the components of orientations, and without the place of a tool beside joints with numbers; with
    a note on what is not used."""
    parts: dict[str, dict[str, Recorded]] = defaultdict(dict)
    for one in (*found.recorded, *found.constant):
        if one.column and (named := COMPONENT.fullmatch(one.column)):
            parts[named[1]][named[2].lower()] = one
    whole = {before: four for before, four in parts.items() if set(four) == set("xyzw") and _is_unit(four)}
    if not whole:
        return found
    left = {id(one) for four in whole.values() for one in four.values()}
    notes = [
        f"{', '.join(four[axis].column for axis in 'xyzw')} are an orientation (a quaternion), which is no joint's motion"
        for four in whole.values()
    ]
    if len(_numbers(found.recorded)) >= FEWEST_JOINTS:
        tool = [
            one
            for one in found.recorded
            if any(one.column == before + axis for before in whole for axis in "xyz")
        ]
        left |= {id(one) for one in tool}
        notes += (
            [f"{', '.join(one.column for one in tool)} are the place of what the joints move"] if tool else []
        )
    kept = tuple(one for one in found.recorded if id(one) not in left)
    return replace(found, recorded=kept, left_out=(*found.left_out, *notes))


def with_numbers_as_joints(found: Inventory) -> Inventory:
    """The inventory with the joint of every column that is called by a joint's number alone, where several are."""
    numbers = _numbers((*found.recorded, *found.constant))
    if len(set(numbers.values())) < FEWEST_JOINTS:
        return found
    recorded, constant = (
        tuple(replace(one, joint=numbers.get(id(one), one.joint)) for one in part)
        for part in (found.recorded, found.constant)
    )
    return replace(found, recorded=recorded, constant=constant)


def with_joint_positions(known: Sequence[Known]) -> list[Known]:
    """The numbers, of which those that are called by a joint's number alone are its position."""
    numbers = _numbers([one.one for one in known if one.one.joint and one.quantity is None])
    reason = "a joint's number and no quantity: its position"
    return [
        replace(one, meaning=replace(one.meaning, quantity="position", certain=True, reason=reason))
        if id(one.one) in numbers
        else one
        for one in known
    ]


def _numbers(recorded: Sequence[Recorded]) -> dict[int, str]:
    """The joints' numbers of columns that are called by nothing else, by identity."""
    named = ((one, NUMBERED.fullmatch(one.column)) for one in recorded if one.column and not one.unit)
    return {id(one): found[1] for one, found in named if found}


def _is_unit(four: dict[str, Recorded]) -> bool:
    values = [one.value for one in four.values()]
    if len({len(one) for one in values}) > 1:
        return False
    length = np.sqrt(np.sum(np.square(values), axis=0))
    return float(np.mean(np.abs(length - 1.0) <= UNIT_LENGTH)) >= MOSTLY
