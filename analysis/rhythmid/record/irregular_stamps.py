"""Distinguishes irregular timestamps, such as those of a logger without a fixed rate, from lost samples.

A lost sample leaves a step close to two, three, ... periods, as close as other steps are to one. If long steps are
common and have other lengths, nothing was lost: the times are irregular, the period is only the mean step, and only
a pause far longer than the usual steps is a gap. The times are also irregular if steps far shorter than the usual
one are common.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
COMMON = 0.01  # share of long steps up to which they are single gaps of any length
# median distance of long steps from a whole number of periods: up to NEAR it is rounding of timestamps with lost
# samples; above FAR jitter of less than 0.3 periods cannot cause it (times without a period give a quarter)
NEAR, FAR = 0.1, 0.2
# ratio of this distance to that of the other steps from one period, used between NEAR and FAR: jitter affects both alike
FARTHER = 2.0
# in periods: the mean step cannot be shorter, as losses lengthen it and jitter does not change it
SHORTER = 0.9
USUAL = 0.99  # quantile of irregular steps that defines the longest usual one
# ratio to it above which a step is a pause: one in ten thousand steps between random events is as long
PAUSE = 2.0


def irregular(step: Array, period: float, long: Array) -> bool:
    """Whether steps (n,) [s] of nominal period `period` come from irregular timestamps. `long` (g,) are some of the
    steps that are too long and not compensated by short ones; False where they are rare."""
    if len(long) == 0:
        return False
    others = step[step < 1.5 * period]
    scatter = float(np.median(np.abs(others / period - 1.0))) if len(others) else 0.0
    away = float(np.median(np.abs(long / period - np.rint(long / period))))
    return away > float(np.clip(FARTHER * scatter, NEAR, FAR))


def too_short(step: Array, period: float, gaps: float) -> bool:
    """Whether steps (n,) [s] are on average shorter than their apparent period, without the `gaps` [s] by which all
    steps together exceed that of one lost sample. Late samples that arrive in a burst do not shorten the mean."""
    return float(np.sum(step)) - gaps < SHORTER * period * len(step)


def usual_range(step: Array) -> tuple[float, float]:
    """Shortest and longest usual step [s] of irregular timestamps: the 1 % and 99 % quantiles."""
    shortest, longest = np.quantile(step, [1.0 - USUAL, USUAL], method="nearest")
    return float(shortest), float(longest)
