"""Numbers that never change within a recording, but from one recording to the next: the steps of a drive."""

from collections.abc import Sequence
from pathlib import Path

from rhythmid.errors import InputError
from rhythmid.record.inventory import Inventory, inventory


def stepped(found: Inventory, sources: Sequence[str | Path], rate: float | None) -> frozenset[str]:
    """Names of the constants of one recording that are constant in others, too, at another level in at least one."""
    levels = {str(one): {float(one.value[0])} for one in found.constant}
    for source in sources if levels else ():
        try:
            other = inventory(source, rate)
        except InputError:  # what cannot be read is refused where it is used
            continue
        here = {str(one): float(one.value[0]) for one in other.constant}
        levels = {name: {*values, here[name]} for name, values in levels.items() if name in here}
    return frozenset(name for name, values in levels.items() if len(values) > 1)
