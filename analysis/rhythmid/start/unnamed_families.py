"""Families of columns without names: groups of one column for each joint, told apart by the data."""

from collections.abc import Sequence

from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.start.direction import COPY
from rhythmid.start.families import Family
from rhythmid.start.meaning import Meaning
from rhythmid.start.relation import follows
from rhythmid.start.unnamed_joints import column_groups
from rhythmid.start.vocabulary import Quantity

HOW = (
    "its columns have no names; without names, joints are recognised only if the columns stand in groups of one column for each joint, the "
    "speeds right after the positions; else give the table a first line of names, such as  t, q1, q2, tau1, tau2"
)


def without_names(found: Inventory) -> bool:
    """Whether a source is a table whose columns have no names."""
    every = (*found.recorded, *found.constant)
    return bool(every) and all(one.column.isdigit() for one in every)


def unnamed_families(found: Inventory) -> list[Family]:
    """The families of a table without names: positions, speeds, and what else was recorded of every joint; none where no columns are
    positions whose slopes follow as far behind as there are joints.

    What is no copy of a motion may be an effort.
    """
    groups = column_groups(found)
    if groups is None:
        return []
    columns = {int(one.column): one for one in (*found.recorded, *found.constant)}
    count, last = groups.count, max(columns)
    parts = [
        [columns[first + joint] for joint in range(count)]
        for first in range(groups.first, last + 2 - count, count)
        if all(first + joint in columns for joint in range(count))
    ]
    positions, speeds = (
        next(part for part in parts if int(part[0].column) == groups.first + number * count)
        for number in (groups.position, groups.velocity)
    )
    made: list[Family] = []
    for part in parts:
        if part is positions or part is speeds:
            quantity: Quantity = "position" if part is positions else "velocity"
            made.append(_family(part, quantity, "one is the integral of the other"))
        elif _copies(positions, part):
            made.append(_family(part, "position", "they are copies of the positions"))
        elif not _copies(speeds, part):
            made.append(_family(part, "effort", "they are no copies of a motion"))
    return made


def _family(members: Sequence[Recorded], quantity: Quantity, reason: str) -> Family:
    said = f"no name says it; columns in groups of {len(members)}, of which {reason}"
    meaning = Meaning(quantity, None, False, False, "", said, False)
    pattern = f"columns {members[0].column} to {members[-1].column}"
    return Family(
        "", pattern, {str(place): one for place, one in enumerate(members, start=1)}, False, meaning
    )


def _copies(motion: Sequence[Recorded], others: Sequence[Recorded]) -> bool:
    """Whether at most joints the others are copies of a motion, earlier or later."""
    told = [follows(one, other) for one, other in zip(motion, others, strict=True)]
    return sum(one.is_copy and one.correlation >= COPY for one in told) * 2 > len(told)
