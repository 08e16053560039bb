"""Selection of records in which the machine moves. Records at rest contain no information; a fit would only follow
their noise."""

from collections.abc import Sequence

from rhythmid.errors import InputError
from rhythmid.record.cleaning import Cleaned
from rhythmid.record.standstill import standstill


def moving(clean: Sequence[Cleaned]) -> tuple[list[Cleaned], tuple[str, ...]]:
    """The records in which the machine moves, and a note on each record that is left out.

    Noise that may hide a motion is kept and judged by the fit. Raises InputError where the machine is at rest in all
    records.
    """
    found = [(one, standstill(one.record, buried=False)) for one in clean]
    kept = [one for one, still in found if still is None]
    still = [f"{one.record.name}: {why}" for one, why in found if why is not None]
    if still and not kept:
        more = f" (and {len(still) - 1} more records)" if len(still) > 1 else ""
        raise InputError(f"{still[0]}{more}")
    return kept, tuple(f"{one}; it is left out" for one in still)
