"""Measured efforts recorded without their sign: they give the magnitude but not the direction, and are no effort of
a model."""

import numpy as np

from rhythmid.record.inventory import Recorded
from rhythmid.record.unsigned import WHY, is_unsigned
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


def _is(one: Recorded, output: Recorded) -> bool:
    period, effort, position = together(one, output)
    return is_unsigned(np.arange(len(effort), dtype=np.float64) * period, position, effort)
