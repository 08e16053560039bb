"""How often a driving signal rises and falls.

Whether a delay, a gain or a clock changes with time shows where the drive changes twice in the same direction. A rise and a
fall alone do not show it: with dry friction, play or a dead band, a machine starts late and stops early.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rises_and_falls(drive: Array) -> tuple[int, int]:
    """Number of times at which a signal (n,) rises and falls; a ramp of successive samples is one change."""
    way = np.sign(np.diff(drive))
    begins = np.insert(way[1:] != way[:-1], 0, True) if len(way) else np.zeros(0, dtype=bool)
    return int(np.count_nonzero(begins & (way > 0.0))), int(np.count_nonzero(begins & (way < 0.0)))
