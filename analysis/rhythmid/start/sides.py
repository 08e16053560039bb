"""Columns of a left and a right one: `w_l` and `w_r`, `pwml` and `pwmr`, `left_speed` and `right_speed`. There an `r` is a side, and no
reference."""

import re
from collections.abc import Iterator
from dataclasses import replace

from rhythmid.record.inventory import Inventory, Recorded

OTHER = {"l": "r", "r": "l", "left": "right", "right": "left"}
SIDES = {"l": "left", "r": "right", "left": "left", "right": "right"}
# a word of its own, the last word of a name such as kneeLeft, the last letter of a name that is one word
WRITTEN = (
    re.compile(r"(?<![A-Za-z])(left|right|l|r)(?![A-Za-z])", re.IGNORECASE),
    re.compile(r"(?<=[a-z0-9])(Left|Right|L|R)(?![a-z])"),
    re.compile(r"^[a-z]{1,4}(l|r)$"),
)


def with_sides(found: Inventory) -> Inventory:
    """The inventory with the side of every column whose name is another one's but for it."""
    names = {one.said.lower() for one in found.recorded if one.column}
    sided = tuple(_with_side(one, names) if one.column else one for one in found.recorded)
    return replace(found, recorded=sided)


def _with_side(one: Recorded, names: set[str]) -> Recorded:
    """The column with its side, and without it in its name, where the other side's is there, too."""
    for begin, end in _places(one.said):
        side = one.said[begin:end].lower()
        before, after = one.said[:begin], one.said[end:]
        if f"{before}{OTHER[side]}{after}".lower() in names and (before + after).strip("_. "):
            return replace(one, said=f"{before} {after}".strip(), side=SIDES[side])
    return one


def _places(name: str) -> Iterator[tuple[int, int]]:
    """Where a side may stand in a name."""
    for written in WRITTEN:
        yield from (match.span(1) for match in written.finditer(name))
