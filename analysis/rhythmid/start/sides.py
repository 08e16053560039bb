"""Columns for left and right: `w_l` and `w_r`, `pwml` and `pwmr`, `left_speed` and `right_speed`, `Lspeed` and
`RSpeed`, and the corners of a vehicle. There `r` means right, not reference."""

import re
from collections.abc import Iterator
from dataclasses import replace

from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.start.meaning import is_word
from rhythmid.start.words import words_of

OTHER = {"l": "r", "r": "l", "left": "right", "right": "left"}
SIDES = {
    "l": "left",
    "r": "right",
    "left": "left",
    "right": "right",
    "fl": "front_left",
    "fr": "front_right",
    "rl": "rear_left",
    "rr": "rear_right",
    "bl": "back_left",
    "br": "back_right",
}
# a separate word, the last word of a name such as kneeLeft, the last letter of a one-word name
WRITTEN = (
    re.compile(r"(?<![A-Za-z])(left|right|l|r)(?![A-Za-z])", re.IGNORECASE),
    re.compile(r"(?<=[a-z0-9])(Left|Right|L|R)(?![a-z])"),
    re.compile(r"^[a-z]{1,4}(l|r)$"),
)
# before a name with a known word; longer ones first
BEFORE_NAME = re.compile(r"^(left|right|fl|fr|rl|rr|bl|br|l|r)([ _.-]*)(?=[a-z]{2})", re.IGNORECASE)


def with_sides(found: Inventory) -> Inventory:
    """The inventory with the side of every column whose name differs from another one's only in the side, or that
    has a side before a known word where another column has another side."""
    every = [one for one in (*found.recorded, *found.constant) if one.column]
    names = {one.said.lower() for one in every}
    begun = len({side for one in every for side, _ in _before_name(one.said)}) > 1
    recorded, constant = (
        tuple(_with_side(one, names, begun) if one.column else one for one in part)
        for part in (found.recorded, found.constant)
    )
    return replace(found, recorded=recorded, constant=constant)


def _with_side(one: Recorded, names: set[str], begun: bool) -> Recorded:
    """The column with its side, which is removed from its name."""
    for begin, end in _places(one.said):
        side = one.said[begin:end].lower()
        before, after = one.said[:begin], one.said[end:]
        if f"{before}{OTHER[side]}{after}".lower() in names and (before + after).strip("_. "):
            return replace(one, said=f"{before} {after}".strip(), side=SIDES[side])
    for side, rest in _before_name(one.said) if begun else ():
        return replace(one, said=rest, side=side)
    return one


def _places(name: str) -> Iterator[tuple[int, int]]:
    """Positions of a name at which a side may be."""
    for written in WRITTEN:
        yield from (match.span(1) for match in written.finditer(name))


def _before_name(name: str) -> Iterator[tuple[str, str]]:
    """The side before a name with a known word. A side without a separator is before a capital or directly before
    that word."""
    match = BEFORE_NAME.match(name)
    if match is None or is_word(words_of(name)[0]):
        return
    rest, words = name[match.end() :], words_of(name[match.end() :])
    if (match[2] or rest[0].isupper() or is_word(words[0])) and any(map(is_word, words)):
        yield SIDES[match[1].lower()], rest
