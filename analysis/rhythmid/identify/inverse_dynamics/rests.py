"""Where a machine rests: there friction takes any value up to the breakaway force, and no law of the motion tells which effort that balances."""

import math

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.noise import runs

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
STICK = 0.03  # of the fast speed, below which dry friction is set-valued: any force up to the friction (six arm joints, an axis, a frame)
TOLD = 0.1  # of the samples, from which it is told that they are left out: a tenth widens intervals by 1/sqrt(0.9), a twentieth
FAST = 0.95  # quantile of the speed that is called fast


def stick_speed(velocity: Array) -> float:
    """Speed below which a machine with these velocities (n,) counts as resting."""
    return STICK * float(np.quantile(np.abs(velocity), FAST))


def told(share: float) -> str | None:
    """That the machine rests at a share of the samples, where this is of practical size."""
    if share < TOLD:
        return None
    return f"the machine rests at {share:.0%} of the samples, at which friction balances any effort: they are left out"


def resting(slow: Mask, memory: float) -> Mask:
    """Samples (n,) at which the friction is not known: all `slow` ones, and within half the `memory` [samples] of the motion's filter
    of a rest as long as that, for there the filter has mixed motion and rest."""
    out, half = slow.copy(), math.ceil(0.5 * memory)
    for part in runs(slow):
        first, end = part.start, part.stop
        if end - first >= memory:
            out[max(first - half, 0) : end + half] = True
    return out
