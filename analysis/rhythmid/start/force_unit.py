"""Unit of the driving force: the model has one unit, so the commanded and the measured effort should have the same."""

from collections.abc import Sequence

from rhythmid.record.inventory import Recorded
from rhythmid.start.meaning import driving_unit_of
from rhythmid.start.role_choice import Known
from rhythmid.start.vocabulary import ELECTRICAL

MODELLED = (
    "effort",
    "input",
    "forcing",
)  # roles whose unit is the model's, as used in the force balance


def of_one_unit(commanded: Sequence[Known], sensed: Sequence[Known]) -> tuple[list[Known], list[Known]]:
    """The commanded and measured efforts whose unit also occurs on the other side; all of them where there are none."""
    pairs = [(first, second) for first in commanded for second in sensed if _agree(first.one, second.one)]
    if not pairs:
        return list(commanded), list(sensed)
    asked, measured = ({id(one) for one in side} for side in zip(*pairs, strict=True))
    return [one for one in commanded if id(one) in asked], [one for one in sensed if id(one) in measured]


def matching(able: Sequence[Known], picked: Recorded) -> list[Known]:
    """The numbers with the unit of `picked`; all of them where there are none."""
    return [one for one in able if _agree(one.one, picked)] or list(able)


def doubt_of_units(command: Recorded, effort: Recorded) -> str:
    """Doubt about a command that is not in the unit of the measured effort, which is the model's; empty where it is."""
    if _agree(command, effort):
        return ""
    asked, measured = (driving_unit_of(one) or "no known unit" for one in (command, effort))
    return f"it is in {asked}, the measured effort and the model in {measured}: give it the scale between them, or leave one of the two out"


def _agree(first: Recorded, second: Recorded) -> bool:
    """Whether two efforts have the same unit; an unknown unit counts as that of a force or torque."""
    units = {driving_unit_of(one) for one in (first, second)}
    return len(units) == 1 or ("" in units and not units & ELECTRICAL.keys())
