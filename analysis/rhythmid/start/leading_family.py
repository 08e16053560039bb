"""The references of several joints where no name says that they were asked for: positions that the measured ones follow."""

from collections.abc import Sequence

import numpy as np

from rhythmid.record.read import LARGEST
from rhythmid.start.direction import leads
from rhythmid.start.families import Family


def leading_family(families: Sequence[Family], output: Family) -> tuple[Family, Family | None, list[str]]:
    """The measured positions, those that lead them at most joints, and doubts; without such ones only the `output`.

    Of two copies the earlier one was asked for, unless the `output` is called measured.
    """
    told: list[str] = []
    for one in families:
        able = one is not output and one.quantity == "position" and not one.commanded
        if not able or one.members.keys() != output.members.keys():
            continue
        if damaged := [str(each) for each in one.members.values() if np.nanmax(np.abs(each.value)) > LARGEST]:
            told.append(
                f"input: {one.pattern} may be the references; it is not used, because {', '.join(damaged)} has values beyond {LARGEST:g}"
            )
            continue
        if _leads(one, output):
            return output, one, [_doubt(one, output)]
        if output.said.commanded is None and _leads(output, one):
            return one, output, [_doubt(output, one)]
    return output, None, told


def _leads(first: Family, second: Family) -> bool:
    """Whether at most joints the second is a later copy of the first."""
    told = [leads(one, second.members[joint]) is not None for joint, one in first.members.items()]
    return sum(told) * 2 > len(told)


def _doubt(first: Family, second: Family) -> str:
    return (
        f"input: no name says that {first.pattern} was asked for; it is taken for the reference, because {second.pattern} follows it: "
        "if it is another sensor, delete it"
    )
