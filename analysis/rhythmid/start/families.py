"""Families of channels: numbers recorded together for several joints, and the robot's joints to which they belong.

A family consists of fields of one message that differ in the joint's name, columns whose names differ in it or in a
number, or entries of an array.
"""

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from rhythmid.record.inventory import Inventory, Recorded
from rhythmid.start.meaning import Meaning, meaning_of
from rhythmid.start.vocabulary import Quantity
from rhythmid.start.words import words_of

GENERIC = frozenset({"joint"})  # words that a robot's file and its recordings add to joint names arbitrarily

FEWEST_MATCHED = (
    2  # joints by which names with another beginning are matched: one alone has nothing to be told from
)


@dataclass(frozen=True, eq=False)
class Family:
    """Channels that differ only in the joint.

    Attributes
    ----------
    topic : of a message; empty for columns.
    pattern : the field or the name of the column with a star instead of the joint.
    members : by the joint's name in the recording, or its number.
    told : whether joints are identified by names rather than by numbers, whose order is a guess.
    meaning : what its numbers are, where that is not said by their names.
    """

    topic: str
    pattern: str
    members: Mapping[str, Recorded]
    told: bool
    meaning: Meaning | None = None

    @property
    def first(self) -> Recorded:
        """The first member, as a representative of all."""
        return next(iter(self.members.values()))

    @property
    def said(self) -> Meaning:
        """What its members are: by their names without that of the joint, of which a part may be a word (axis_a has the letter of an acceleration)."""
        if self.meaning is not None:
            return self.meaning
        joint, first = next(iter(self.members.items()))
        rest = first.said.replace(joint, " ", 1)
        return meaning_of(replace(first, said=rest) if self.told and words_of(rest) else first)

    @property
    def quantity(self) -> Quantity | None:
        """Quantity of its members; None where nothing states it."""
        return self.said.quantity

    @property
    def commanded(self) -> bool:
        """Whether its members are commanded rather than measured."""
        return self.said.commanded is True

    def channel(self, bag: bool) -> str:
        """The channel in the notation of signals.yaml, without braces."""
        if "*" not in self.pattern:
            named = f"column: [{', '.join(one.column for one in self.members.values())}]"
        elif bag:
            named = f"topic: {self.topic}, field: {json.dumps(self.pattern)}"
        else:
            named = f"column: {json.dumps(self.pattern)}"
        unit = f", unit: {json.dumps(self.first.unit)}" if self.first.unit else ""
        scale = "" if self.first.scale == 1.0 else f", scale: {self.first.scale:.10g}"
        return named + unit + scale


def families_of(found: Inventory, joints: Sequence[str]) -> Iterator[Family]:
    """The families of channels in a source, in descending order of the number of members."""
    made: dict[tuple[str, str, bool], dict[str, Recorded]] = {}
    for one in found.recorded:
        for topic, pattern, name, told in _patterns(one, joints):
            made.setdefault((topic, pattern, told), {})[name] = one
    sizes = sorted(made.items(), key=lambda each: (-len(each[1]), not each[0][2], len(each[0][1])))
    used: set[tuple[str, int]] = set()
    for (topic, pattern, told), members in sizes:
        left = {name: one for name, one in members.items() if (topic, id(one)) not in used}
        if len(left) > 1 or (left and told):
            used |= {(topic, id(one)) for one in left.values()}
            yield Family(topic, pattern, left, told)


def with_constants(family: Family, found: Inventory, joints: Collection[str]) -> Family:
    """The family with the numbers of these joints that never change, as the effort of a joint without a motor."""
    still = {
        name: one
        for one in found.constant
        for topic, pattern, name, told in _patterns(one, list(joints))
        if (topic, pattern, told) == (family.topic, family.pattern, family.told)
        and name in joints and name not in family.members
    }  # fmt: skip
    return replace(family, members={**family.members, **still}) if still else family


def _patterns(one: Recorded, joints: Sequence[str]) -> Iterator[tuple[str, str, str, bool]]:
    """Topic, pattern, the joint's name in the recording, and whether it is a name, for every possible family of a
    channel."""
    if one.topic:
        if one.joint and f"[{one.joint}]" in one.field:
            yield one.topic, one.field.replace(f"[{one.joint}]", "[*]"), one.joint, True
        return
    if "*" in one.column:  # a pattern cannot name it
        return
    for joint in joints:
        for name in {joint, _plain(joint)}:
            if name and name in one.column:
                yield "", one.column.replace(name, "*", 1), name, True
    for number in re.finditer(r"\d+", one.column):
        begin, end = number.span()
        yield "", f"{one.column[:begin]}*{one.column[end:]}", number.group(), False


def _plain(joint: str) -> str:
    """A joint's name without generic words."""
    return "_".join(word for word in re.split(r"[_\s]+", joint) if word.lower() not in GENERIC)


def joints_of(own: Sequence[str], recorded: Sequence[str], told: bool) -> dict[str, str]:
    """The recording's name of every recorded joint of the robot, in the robot's order."""
    if not told:
        inside = sorted(recorded, key=int)
        return dict(zip(own, inside, strict=False)) if len(inside) <= len(own) else {}
    known = {frozenset(words_of(name)) - GENERIC: name for name in recorded}
    found = {
        joint: joint if joint in recorded else known.get(frozenset(words_of(joint)) - GENERIC)
        for joint in own
    }
    return {joint: name for joint, name in found.items() if name is not None} or _by_what_differs(
        own, recorded
    )


def _by_what_differs(own: Sequence[str], recorded: Sequence[str]) -> dict[str, str]:
    """Joints matched by what tells them apart from their neighbours: `fer_joint1` is `panda_joint1`; numbers alone go by the file's order.

    Empty where a joint of the recording is left over or would be two of the robot's.
    """
    theirs = _distinct(recorded)
    mine = _distinct(own)
    if len(recorded) < FEWEST_MATCHED or len(set(theirs.values())) < len(recorded):
        return {}
    found = {joint: name for joint, rest in mine.items() for name, known in theirs.items() if rest == known}
    if len(set(found.values())) == len(found) == len(recorded):
        return found
    numbers = [min(rest) if len(rest) == 1 else "" for rest in theirs.values()]
    if len(recorded) == len(own) and all(one.isdigit() for one in numbers):
        order = sorted(theirs, key=lambda name: int(min(theirs[name])))
        return dict(zip(own, order, strict=True))
    return {}


def _distinct(names: Sequence[str]) -> dict[str, frozenset[str]]:
    """The words of each name, its number apart, without those with which all names begin."""
    split = {name: [one for word in words_of(name) for one in re.findall(r"\d+|\D+", word)] for name in names}
    same = 0
    while len({words[same] if same < len(words) else "" for words in split.values()}) == 1 and same < min(map(len, split.values())):  # fmt: skip
        same += 1
    return {name: frozenset(words[same:]) - GENERIC for name, words in split.items()}
