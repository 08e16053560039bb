"""How often a driving signal passes through one level in the same direction.

Whether a delay, a gain or a clock changes with time shows where the drive does the same twice. A rise and a fall, or steps
between different levels, do not show it: with dry friction, play or a dead band a machine starts late and stops early, and the gain
of an actuator may change with the level.
"""

from collections import defaultdict
from collections.abc import Hashable, Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# share of the range by which a signal that is interpolated between its samples may swing beside a step [Gibbs: 9 % above it and
# 5 % below it thereafter]; rounding errors of held samples
RINGING, ROUNDING = 0.15, 1e-9
MOST_TURNS = 10_000  # of a signal that are looked at: a drive that turns round so often does the same twice


def most_repeated(drives: Iterable[tuple[Hashable, Array, bool]]) -> int:
    """The largest number of times at which a drive passes through one level in the same direction within one record.

    Each drive (n,) comes with what names its record and its channel, and with whether its samples are held. A record may consist
    of several parts. Swings that are small beside the largest range of all parts do not count.
    """
    known = list(drives)
    span = max((float(np.ptp(drive)) for _, drive, _ in known if len(drive)), default=0.0)
    if span == 0.0:
        return 0
    sweeps: dict[tuple[Hashable, bool], list[Array]] = defaultdict(list)
    for record, drive, held in known:
        turns = _turns(drive, span * (ROUNDING if held else RINGING))
        for rising in (True, False):
            way = np.diff(turns) > 0.0 if rising else np.diff(turns) < 0.0
            ends = np.column_stack([turns[:-1], turns[1:]])[way]
            sweeps[record, rising].append(np.sort(ends, axis=1))
    return max((_deepest(np.concatenate(one)) for one in sweeps.values()), default=0)


def _turns(drive: Array, least: float) -> Array:
    """First and last value of a signal (n,), and those at which it turns round, without swings smaller than `least`."""
    way = np.sign(np.diff(drive))
    moves = np.flatnonzero(way)
    if not len(moves):
        return drive[:1]
    turning = moves[1:][way[moves[1:]] != way[moves[:-1]]]
    kept = [float(drive[0])]
    extreme, rising = float(drive[0]), None
    for value in (*drive[turning[:MOST_TURNS]].tolist(), float(drive[-1])):
        if rising is None and abs(value - kept[0]) >= least:
            extreme, rising = value, value > kept[0]
        elif rising is not None and (value > extreme) == rising:
            extreme = value
        elif rising is not None and abs(value - extreme) >= least:
            kept.append(extreme)
            extreme, rising = value, not rising
    return np.array([*kept, extreme] if rising is not None else kept)


def _deepest(intervals: Array) -> int:
    """The largest number of intervals (m, 2) that share a level; those that only touch share none."""
    levels = intervals.ravel()
    steps = np.tile([1, -1], len(intervals))
    order = np.lexsort((steps, levels))  # at one level an interval ends before the next one begins
    return int(np.cumsum(steps[order]).max(initial=0))
