"""Lateness of events relative to their due time: counts, mean, 99th percentile, maximum in constant memory."""

from __future__ import annotations

PERCENTILES = (50.0, 99.0, 99.9)  # percentiles that are reported
_BIN_NS = 10_000
_BINS = 10_000


class Lateness:
    """A histogram of delays past a due time, 10 us bins up to 100 ms; mean and maximum are exact.

    `late` counts the events that came more than `limit_ns` after they were due.
    """

    def __init__(self, limit_ns: int) -> None:
        self.count = self.late = 0
        self._limit_ns = limit_ns
        self.max_ns = 0
        self._sum_ns = 0
        self._bins = [0] * (_BINS + 1)

    def add(self, late_ns: int) -> None:
        """Count one event that came `late_ns` >= 0 after it was due."""
        self.count += 1
        self.late += late_ns > self._limit_ns
        self._sum_ns += late_ns
        if late_ns > self.max_ns:
            self.max_ns = late_ns
        self._bins[min(late_ns // _BIN_NS, _BINS)] += 1

    @property
    def mean_ns(self) -> float:
        return self._sum_ns / self.count if self.count else 0.0

    def percentile_ns(self, percent: float) -> int:
        """Upper edge of the bin that holds the percentile; beyond the last bin, and at most, the maximum."""
        wanted, seen = self.count * percent / 100.0, 0
        for index, number in enumerate(self._bins):
            seen += number
            if seen >= wanted and seen and index < _BINS:
                return min((index + 1) * _BIN_NS, self.max_ns)
        return self.max_ns

    def to_dict(self) -> dict[str, float]:
        """Counts and times [s] for the topic `run`."""
        return {
            "of": self.count,
            "late": self.late,
            "mean": round(1e-9 * self.mean_ns, 9),
            "p99": 1e-9 * self.percentile_ns(99.0),
            "max": 1e-9 * self.max_ns,
        }

    def summary(self, name: str) -> dict[str, str]:
        """Diagnostic values `<name>_mean|p50|p99|p99.9|max` in milliseconds."""
        percentiles = {
            f"{name}_p{percent:g}_ms": f"{self.percentile_ns(percent) * 1e-6:.4f}" for percent in PERCENTILES
        }
        return {
            f"{name}_mean_ms": f"{self.mean_ns * 1e-6:.4f}",
            **percentiles,
            f"{name}_max_ms": f"{self.max_ns * 1e-6:.4f}",
        }
