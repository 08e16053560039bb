"""Encoder counts that restart after each turn: number of counts per turn, from the size of the jumps."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.angle_wrap import wraps_by

# counts per turn: powers of two for absolute encoders, and degrees with up to three decimals
TURNS = (*(float(2**bits) for bits in range(8, 33)), 360.0, 3600.0, 36000.0, 360000.0)
# largest motion in a step, as a share of a turn: of a half, no reading tells the direction; by a quarter the jumps are three times as large as
# any other step, as those of a switched command are not
FASTEST = 0.25
ROWS = 0.95  # share of steps of one size above which a counter counts rows or time and no motion


def counts_of_turn(value: NDArray[np.float64]) -> float:
    """Number of counts after which values (n,) restart while the motion goes on; 0 where they do not, or where they
    only count rows."""
    value = value[np.isfinite(value)]
    if len(value) < 3 or value.min() < 0.0 or ((value != np.rint(value)).any() and value.max() > 360.0):
        return 0.0
    found = next((turn for turn in TURNS if value.max() < turn and len(wraps_by(value, turn))), 0.0)
    if not found:
        return 0.0
    step = np.diff(np.unwrap(value, period=found))
    if np.abs(step).max() > FASTEST * found:
        return 0.0
    return 0.0 if float(np.mean(step == np.median(step))) > ROWS else found
