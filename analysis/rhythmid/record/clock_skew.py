"""Clock skew: rate of the clock that stamps a channel relative to the clock of the receiver.

It is measured by the latency of messages, receive time minus stamp, which grows or shrinks steadily with the skew.
Single messages are held up, most of them only a little. Each stretch of the recording is represented by its median;
S. B. Moon, P. Skelly, D. Towsley, Proc. IEEE INFOCOM (1999) 227, use the least delays. The scatter of the medians
about the line gives the uncertainty.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STRETCHES = 30  # stretches of a recording, with one median each
SAMPLES_OF_A_STRETCH = 20  # least number of samples of a stretch
# [s] resolution of stamps: no skew is known better than this over the length of the recording
STAMP_RESOLUTION = 1e-9


@dataclass(frozen=True)
class ClockSkew:
    """Rate `rate` [s/s] by which the stamping clock is faster than the receiver's clock, and its standard deviation
    `std` [s/s]."""

    rate: float
    std: float


def clock_skew(time: NDArray[np.float64], lateness: NDArray[np.floating]) -> ClockSkew | None:
    """Skew from stamps (n,) [s] and latencies, receive time minus stamp, (n,) [s]; None for a recording that is too
    short."""
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
