"""Stamps at irregular times, such as those of a logger that writes when it gets round to it, told from lost samples.

A lost sample leaves a step near two, three, ... periods, as near as the other steps are to one. Where long steps are common and
lie elsewhere, nothing was lost: the times are irregular, there is no period but the mean step, and only a pause far beyond the
usual steps is a gap. So they are where steps far shorter than the usual one are common.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
COMMON = 0.01  # share of steps that are too long, up to which they are single gaps, of whatever length
# periods from the nearest whole number of them, as the median of long steps: up to NEAR rounding of stamps puts lost samples there,
# beyond FAR jitter of less than 0.3 periods does not (a quarter is what times without any period give)
NEAR, FAR = 0.1, 0.2
FARTHER = 2.0  # times as far as the other steps from one period, between the two: jitter moves both alike
SHORTER = 0.9  # of the period, below which the mean step cannot be: losses lengthen it, and jitter leaves it as it is
USUAL = 0.99  # quantile of irregular steps that is the longest usual one
PAUSE = (
    2.0  # times as long, a step is a pause: of steps as random as those between events one in ten thousand
)


def irregular(step: Array, period: float, long: Array) -> bool:
    """Whether steps (n,) [s] whose nominal period is `period` are those of irregular stamps; `long` (g,) are some of those that are
    too long and that no short ones make up for; none where they are rare."""
    if len(long) == 0:
        return False
    others = step[step < 1.5 * period]
    scatter = float(np.median(np.abs(others / period - 1.0))) if len(others) else 0.0
    away = float(np.median(np.abs(long / period - np.rint(long / period))))
    return away > float(np.clip(FARTHER * scatter, NEAR, FAR))


def too_short(step: Array, period: float) -> bool:
    """Whether steps (n,) [s] are on average shorter than what seems their period; a gap counts for as much as one lost sample does."""
    return float(np.mean(np.minimum(step, 2.0 * period))) < SHORTER * period


def usual_range(step: Array) -> tuple[float, float]:
    """Shortest and longest usual step [s] of irregular stamps: all but 1 % are longer, and all but 1 % shorter."""
    shortest, longest = np.quantile(step, [1.0 - USUAL, USUAL], method="nearest")
    return float(shortest), float(longest)
