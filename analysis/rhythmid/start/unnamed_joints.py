"""Unnamed columns of several joints: groups of one column per joint, first all positions, then all velocities, then
the other quantities."""

from collections import defaultdict
from dataclasses import dataclass, replace

from rhythmid.record.inventory import Inventory
from rhythmid.start.relation import integrals
from rhythmid.start.role_choice import Known
from rhythmid.start.vocabulary import Quantity

# least number of joints whose velocities follow their positions at the same distance, for columns to form groups
FEWEST_JOINTS = 2


@dataclass(frozen=True)
class ColumnGroups:
    """Groups of `count` columns; the first group begins at column `first`. `position` and `velocity` are indices of
    groups, counted from 0."""

    first: int
    count: int
    position: int
    velocity: int

    def told(self, one: Known) -> Known:
        """The number of a column with its joint, counted from 1, and its quantity if it is a position or velocity."""
        group, joint = divmod(int(one.one.column) - self.first, self.count)
        quantities: dict[int, Quantity] = {self.position: "position", self.velocity: "velocity"}
        meaning = replace(one.meaning, joint=str(joint + 1), quantity=quantities.get(group))
        if meaning.quantity is None:
            return replace(one, meaning=meaning)
        reason = (
            f"no name says it; columns in groups of {self.count}, of which one is the integral of another"
        )
        return replace(one, meaning=replace(meaning, reason=reason))


def column_groups(found: Inventory) -> ColumnGroups | None:
    """The groups of a table with numbers as column names; None where there are not two joints with positions and
    velocities."""
    every = (*found.recorded, *found.constant)
    if not every or not all(one.column.isdigit() for one in every):
        return None
    first = min(int(one.column) for one in every)
    pairs: dict[int, list[int]] = defaultdict(list)
    for motion, slope, _ in integrals(found.recorded):
        count = int(slope.column) - int(motion.column)
        if count >= FEWEST_JOINTS:
            pairs[count].append(int(motion.column) - first)
    for count, places in sorted(pairs.items(), key=lambda pair: -len(pair[1])):
        group = places[0] // count
        if len(places) >= FEWEST_JOINTS and all(place // count == group for place in places):
            return ColumnGroups(first, count, group, group + 1)
    return None
