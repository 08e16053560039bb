"""Rates with their intervals."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rhythmid.proof.score import Score
from rhythmid.statistics import NORMAL_95


@dataclass(frozen=True)
class Rate:
    """A count out of a total, with the 95 % interval of E. B. Wilson (J. Am. Stat. Assoc. 22 (1927) 209)."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        return self.hits / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        if not self.of:
            return 0.0, 1.0
        z2, n, p = NORMAL_95**2, self.of, self.share
        centre = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = NORMAL_95 / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        return max(0.0, centre - half), min(1.0, centre + half)

    def __str__(self) -> str:
        if not self.of:
            return "–"
        low, high = self.interval
        return f"{self.hits}/{self.of} = {100 * self.share:.1f} % ({100 * low:.1f}–{100 * high:.1f})"

    def to_dict(self) -> dict[str, Any]:
        low, high = self.interval
        return {"hits": self.hits, "of": self.of, "share": self.share, "interval": [low, high]}


def rate(scores: Sequence[Score], holds: Callable[[Score], bool]) -> Rate:
    """The rate of scores for which `holds` is true."""
    return Rate(sum(map(holds, scores)), len(scores))
