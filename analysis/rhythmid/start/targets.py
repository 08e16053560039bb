"""References named as their motion with a `t` for target before it: `tq_0` beside `q_0`, `tpos` beside `pos`."""

from collections.abc import Sequence
from dataclasses import replace

from rhythmid.start.role_choice import Known

TARGET = "t"
AIMED_AT = frozenset({"position", "velocity"})


def with_targets(known: Sequence[Known], among: Sequence[Known]) -> list[Known]:
    """The known numbers; columns whose names are `t` plus the name of a motion `among` all columns become commands
    of that motion."""
    motions = {
        one.one.said.lower(): one
        for one in among
        if one.one.column and one.quantity in AIMED_AT and one.meaning.commanded is not True
    }
    return [_asked(one, motions.get(_name_after_target(one))) for one in known]


def _name_after_target(one: Known) -> str:
    """A column's name without an initial `t`, where no word or unit states its quantity; else empty."""
    name = one.one.said.lower()
    untold = bool(one.one.column) and not one.meaning.certain
    return name.removeprefix(TARGET) if untold and name.startswith(TARGET) else ""


def _asked(one: Known, motion: Known | None) -> Known:
    if motion is None:
        return one
    reason = f"{TARGET!r} before {motion.one} says that it was asked for"
    return replace(one, meaning=replace(motion.meaning, commanded=True, reason=reason))
