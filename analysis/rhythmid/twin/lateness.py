"""Lateness of measurements: by how much each stamp lies behind the regular grid of the stamps that follow it.

A busy machine passes measurements on late, and a stamp that is given then tells a wrong time. What comes after a stall catches up, so that the
least delay of the stamps within a short while is that of measurements that were not late. After a longer stall what was missed is left out, and nothing
catches up: measurements beside a long gap may be late by as much as it lasts. A message or two that are missing are no lateness.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LOOK = 0.25  # s of later stamps that tell the lateness of one: longer than a stall that leaves a backlog (0.1 s) and its release
STALL = 0.02  # s without a measurement in which the machine may have stood still: a delay of 0.05 s leaves that of a stall of 0.07 s
PERIODS = 5  # that a gap lasts at least, at low rates
UNTOLD = 5e-3  # s of rms lateness above which a segment tells nothing: a twin is to tell a delay that has grown by so much


def lateness(stamps: Array, period: float) -> Array:
    """Lateness (n,) [s] of messages with increasing stamps (n,) [s], one a `period` [s]; what follows the last is not known."""
    behind = stamps - period * np.arange(len(stamps))
    ends = np.searchsorted(stamps, stamps + LOOK, side="right")
    least = np.array([behind[at:end].min() for at, end in enumerate(ends)])
    return behind - least


def possible_lateness(stamps: Array, period: float) -> Array:
    """As `lateness`, and beside a gap its length, (n,) [s]."""
    late = lateness(stamps, period)
    gaps = np.diff(stamps) - period
    for at in np.flatnonzero(gaps > max(STALL, PERIODS * period)):
        beside = (stamps >= stamps[at] - LOOK) & (stamps <= stamps[at + 1] + LOOK)
        late[beside] = np.maximum(late[beside], gaps[at])
    return late


@dataclass(frozen=True)
class Doubt:
    """What is not known of the times of a segment's measurements [s]: the lateness of each, (n,), and its rms for a while."""

    late: Array
    rms: float

    @property
    def punctual(self) -> bool:
        """Whether the segment tells of the physics."""
        return self.rms <= UNTOLD

    @classmethod
    def of(cls, stamps: Array, late: Array, first: int, end: int) -> "Doubt":
        """Of the measurements from `first` to before `end`."""
        since = int(np.searchsorted(stamps, stamps[first] - LOOK))
        return cls(late[first:end], float(np.sqrt(np.mean(late[since:end] ** 2))))
