"""Samples of one signal: new ones are appended at the end, old ones dropped at the beginning."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Samples:
    """Times [s], increasing, and values of one signal. Samples that are not finite or not newer than the last are dropped and counted."""

    def __init__(self) -> None:
        self.time = np.empty(0)
        self.value = np.empty(0)
        self.refused = 0

    def __len__(self) -> int:
        return len(self.time)

    @property
    def newest(self) -> float:
        """Time of the newest sample [s]; minus infinity where there is none."""
        return float(self.time[-1]) if len(self.time) else -np.inf

    def append(self, time: Array, value: Array) -> None:
        """Add samples; shapes (n,), (n,)."""
        highest = np.maximum.accumulate(np.concatenate([[self.newest], time]))[:-1]
        kept = np.isfinite(value) & (time > highest)
        self.refused += int(len(kept) - kept.sum())
        self.time = np.concatenate([self.time, time[kept]])
        self.value = np.concatenate([self.value, value[kept]])

    def forget(self, before: float, keep: int = 1) -> None:
        """Drop samples older than `before` [s], but keep the last `keep` of them."""
        first = max(0, int(np.searchsorted(self.time, before)) - keep)
        self.time, self.value = self.time[first:], self.value[first:]

    def between(self, start: float, end: float, margin: int = 1) -> tuple[Array, Array]:
        """Samples from start to end [s], and `margin` more on either side."""
        first, last = np.searchsorted(self.time, [start, end], side="right")
        inside = slice(max(0, int(first) - margin), int(last) + margin)
        return self.time[inside], self.value[inside]
