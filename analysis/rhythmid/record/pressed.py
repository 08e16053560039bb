"""Whether a machine is pressed against an end of its travel.

An end stop shows where it throws a machine back, or where it holds it against a drive that has moved it before. A machine
that comes to rest at the end of a motion in one direction, without such a drive, may have been stopped by friction as well.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
END = 0.05  # share of the travel beside an end within which a machine is at that end
SLOW = 0.03  # share of the fast speed (its 95 % quantile) below which a machine rests, as in the balance of forces
# share of the largest drive above which it moves the machine, and does not only ripple about zero
DRIVES = 0.1
# least length of such a rest, as a share of the record: a shorter one may be the turn of a motion
LEAST_SHARE = 0.05


def some_part_is_pressed(parts: Iterable[tuple[Array, Array, Array]]) -> bool:
    """Whether in some part the machine rests at an end of its travel under a drive as large as the one that has moved it there.

    Each part holds position, velocity and drive (n,). A drive that is small beside the largest one of all parts moves nothing.
    """
    known = list(parts)
    peak = max((float(np.abs(drive).max(initial=0.0)) for _, _, drive in known), default=0.0)
    return any(_is_pressed(*one, least=DRIVES * peak) for one in known)


def _is_pressed(position: Array, velocity: Array, drive: Array, least: float) -> bool:
    rests = np.abs(velocity) <= SLOW * float(np.quantile(np.abs(velocity), 0.95))
    for side in (1.0, -1.0):
        outward, place = side * drive, side * position
        moves = ~rests & (side * velocity > 0.0)
        if not moves.any() or (usual := float(np.median(outward[moves]))) <= least:
            continue
        at_end = place >= place.max() - END * float(np.ptp(place))
        if np.mean(rests & at_end & (outward >= usual)) >= LEAST_SHARE:
            return True
    return False
