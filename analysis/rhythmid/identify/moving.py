"""Records in which the machine moves: of those in which it stands still nothing can be learnt, and a fit only follows their noise."""

from collections.abc import Sequence

from rhythmid.errors import InputError
from rhythmid.record.cleaning import Cleaned
from rhythmid.record.standstill import standstill


def moving(clean: Sequence[Cleaned]) -> tuple[list[Cleaned], tuple[str, ...]]:
    """The records in which the machine moves, and a note on each other one, which is left out.

    Noise in which a motion may be buried is judged by what a fit makes of it. Raises InputError where the machine stands still in
    all of them.
    """
    found = [(one, standstill(one.record, buried=False)) for one in clean]
    kept = [one for one, still in found if still is None]
    still = [f"{one.record.name}: {why}" for one, why in found if why is not None]
    if still and not kept:
        more = f" (and {len(still) - 1} more records)" if len(still) > 1 else ""
        raise InputError(f"{still[0]}{more}")
    return kept, tuple(f"{one}; it is left out" for one in still)
