"""Lateness of measurements: by how much each stamp lies behind the regular grid of the stamps that follow it.

A busy machine passes measurements on late, and a stamp that is given then tells a wrong time. What comes after a stall catches up, so that the
least delay of the stamps within a short while is that of measurements that were not late. A gap, after which stamps are regular again, is no lateness.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LOOK = 0.25  # s of later stamps that tell the lateness of one: longer than a stall that leaves a backlog (0.1 s) and its release


def lateness(stamps: Array, period: float) -> Array:
    """Lateness (n,) [s] of measurements with increasing stamps (n,) [s], one a `period` [s]; what follows the last is not known."""
    behind = stamps - period * np.arange(len(stamps))
    ends = np.searchsorted(stamps, stamps + LOOK, side="right")
    least = np.array([behind[at:end].min() for at, end in enumerate(ends)])
    return behind - least


@dataclass(frozen=True)
class Doubt:
    """What is not known of the times of a segment's measurements [s]: the lateness of each, (n,), and its rms for a while."""

    late: Array
    rms: float

    @classmethod
    def of(cls, stamps: Array, late: Array, first: int, end: int) -> "Doubt":
        """Of the measurements from `first` to before `end`."""
        since = int(np.searchsorted(stamps, stamps[first] - LOOK))
        return cls(late[first:end], float(np.sqrt(np.mean(late[since:end] ** 2))))
