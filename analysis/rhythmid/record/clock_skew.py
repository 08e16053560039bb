"""Skew of clocks: by how much faster the clock that stamps a channel runs than the one that receives it.

Seen in how long messages are under way, receipt less stamp, which grows or shrinks steadily where the clocks run apart. Single
messages are held up, most of them little: each stretch of the recording is told by its median, as by the least delays in S. B.
Moon, P. Skelly, D. Towsley, Proc. IEEE INFOCOM (1999) 227, and the scatter of the medians about the line tells how sure it is.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STRETCHES = 30  # of a recording, one median each
SAMPLES_OF_A_STRETCH = 20  # samples of a stretch
STAMP_RESOLUTION = 1e-9  # s; what stamps are whole multiples of, so that no skew is known better than this over the recording


@dataclass(frozen=True)
class ClockSkew:
    """How much faster the stamps run than the clock of receipt, `rate` [s/s], and its standard deviation `std` [s/s]."""

    rate: float
    std: float


def clock_skew(time: NDArray[np.float64], lateness: NDArray[np.floating]) -> ClockSkew | None:
    """Skew from stamps (n,) [s] and what they are older than their receipt (n,) [s]; None of too short a recording."""
    if len(time) < STRETCHES * SAMPLES_OF_A_STRETCH or np.ptp(time) == 0.0:
        return None
    middle = [float(np.median(part)) for part in np.array_split(time, STRETCHES)]
    late = [float(np.median(part)) for part in np.array_split(lateness, STRETCHES)]
    at = np.array(middle) - np.mean(middle)
    power = float(at @ at)
    if power == 0.0:
        return None
    growth = float(at @ late) / power
    left = np.array(late) - np.mean(late) - growth * at
    variance = float(left @ left) / (STRETCHES - 2)
    return ClockSkew(-growth, math.sqrt(variance / power + (STAMP_RESOLUTION / float(np.ptp(time))) ** 2))
