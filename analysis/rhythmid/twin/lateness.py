"""Lateness of measurements: delay of each stamp relative to the regular grid of the stamps that follow it.

A busy machine passes measurements on late; their stamps are then wrong. After a stall the backlog is released quickly. The smallest
delay of the stamps within a short time is therefore that of measurements that were not late. After a longer stall the missed
measurements are lost, and there is no backlog. Measurements beside a long gap may then be late by up to its length. One or two missing
messages are no lateness.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LOOK = 0.25  # [s] of later stamps used for the lateness of one: longer than a stall with a backlog (0.1 s) and its release
STALL = 0.02  # [s] without a measurement that may be a stall: a delay of 0.05 s leaves this much of a stall of 0.07 s
PERIODS = 5  # minimum length of a gap in periods, for low rates
UNTOLD = 5e-3  # [s] rms lateness from which a segment is not used: a twin must detect a delay that has grown by this much


def lateness(stamps: Array, period: float) -> Array:
    """Lateness (n,) [s] of messages with increasing stamps (n,) [s] and the given `period` [s]; unreliable at the end."""
    behind = stamps - period * np.arange(len(stamps))
    ends = np.searchsorted(stamps, stamps + LOOK, side="right")
    least = np.array([behind[at:end].min() for at, end in enumerate(ends)])
    return behind - least


def possible_lateness(stamps: Array, period: float) -> Array:
    """As `lateness`, but at least the length of a gap for measurements beside it, (n,) [s]."""
    late = lateness(stamps, period)
    gaps = np.diff(stamps) - period
    for at in np.flatnonzero(gaps > max(STALL, PERIODS * period)):
        beside = (stamps >= stamps[at] - LOOK) & (stamps <= stamps[at + 1] + LOOK)
        late[beside] = np.maximum(late[beside], gaps[at])
    return late


@dataclass(frozen=True)
class Doubt:
    """Uncertainty of the times of a segment's measurements [s]: the lateness (n,) of each, and its recent rms."""

    late: Array
    rms: float

    @property
    def punctual(self) -> bool:
        """Whether the segment can be used for testing the physics."""
        return self.rms <= UNTOLD

    @classmethod
    def of(cls, stamps: Array, late: Array, first: int, end: int) -> "Doubt":
        """The uncertainty for the measurements from `first` to before `end`."""
        since = int(np.searchsorted(stamps, stamps[first] - LOOK))
        return cls(late[first:end], float(np.sqrt(np.mean(late[since:end] ** 2))))
