"""Measured efforts recorded without their sign: they give the magnitude but not the direction, and are no effort of
a model."""

from collections.abc import Sequence

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.record.unsigned import WHY, is_unsigned
from rhythmid.start.families import Family
from rhythmid.start.relation import together
from rhythmid.start.role_choice import Known


def without_unsigned(
    rest: list[Known], output: Recorded, measured: str | None
) -> tuple[list[Known], list[str]]:
    """The numbers without unsigned efforts, and a note on each; only beside a measured position."""
    if measured != "position":
        return rest, []
    found = [
        one for one in rest if one.quantity == "effort" and not one.meaning.commanded and _is(one.one, output)
    ]
    notes = [f"{one.one} is not used: {WHY}" for one in found]
    return [one for one in rest if one not in found], notes


def unsigned_family(effort: Family, output: Family, reference: Sequence[Family]) -> str:
    """A note on the efforts of several joints that have no sign; empty where they have one.

    All come from one driver: none is used where some have no sign and none ever changes it.
    """
    if any(one.value.min() < 0.0 < one.value.max() for one in effort.members.values()):
        return ""
    found = [
        joint
        for joint, one in output.members.items()
        if _beside(one, effort.members[joint], *(family.members[joint] for family in reference))
    ]
    return f"{effort.pattern} is not used, at {', '.join(found)}: {WHY}" if found else ""


def _beside(output: Recorded, *others: Recorded) -> bool:
    """Whether the first of the others, an effort, has no sign; the second, if there is one, is the reference."""
    at_once = [np.interp(output.time, one.time, one.value) for one in others]
    return is_unsigned(output.time, output.value, *at_once)


def _is(one: Recorded, output: Recorded) -> bool:
    period, effort, position = together(one, output)
    return is_unsigned(np.arange(len(effort), dtype=np.float64) * period, position, effort)
