"""Detector: test whether the innovations of the last seconds are those of a healthy machine, at a given false-alarm rate.

Two statistics are computed over sliding windows. The score statistic is large when a known kind of change would explain the
innovations. The sum of squares is large also when none would. Both are compared with the healthy stretch. Its mean score is
subtracted. Its scatter from window to window gives the overdispersion relative to theory. Thresholds are quantiles of the F
distribution, because the healthy stretch is finite, and so is the knowledge of this scatter.

Every segment tests every window. The probability of each test is the allowed false-alarm rate divided by the number of tests a day.
Tests that share data raise alarms together; counting them as separate only makes false alarms rarer (Bonferroni).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from rhythmid.record.clock_time import DAY
from rhythmid.twin.score import Score, inverse

Array = NDArray[np.float64]
WINDOWS = (1.0, 5.0)  # [s]: the shorter for large changes, the longer for small ones and for isolation
STATISTICS = 2  # tests in each window


@dataclass(frozen=True)
class Threshold:
    """Threshold data of one window length.

    Attributes
    ----------
    segments : segments in the window.
    windows : number of such windows in the healthy stretch.
    score_excess, squares_excess : overdispersion of both statistics there.
    score_freedom : degrees of freedom with which the overdispersion of the score is known.
    squares_mean : mean square of the innovations.
    """

    segments: int
    windows: int
    score_excess: float
    score_freedom: float
    squares_mean: float
    squares_excess: float


@dataclass(frozen=True)
class Healthy:
    """Statistics of healthy operation.

    `offset` (p,) are the changes that explain the mean score, `uncertainty` (p, p) is their inverse information. `probability` is
    that of an alarm in a single test.
    """

    offset: Array
    uncertainty: Array
    thresholds: tuple[Threshold, ...]
    probability: float

    def centred(self, score: Score) -> Array:
        """Score (p,) of a window without its expectation in healthy operation."""
        return score.score - score.information @ self.offset

    def statistic(self, score: Score) -> tuple[float, int]:
        """Score statistic and its degrees of freedom; χ² distributed where the innovations are white."""
        spread = score.information + score.information @ self.uncertainty @ score.information
        inverted, rank = inverse(spread)
        centred = self.centred(score)
        return float(centred @ inverted @ centred), rank

    def mismatch(self, score: Score, threshold: Threshold) -> float:
        """The larger of both statistics of a window, scaled to 0 at the expectation and 1 at the threshold, where the alarm begins."""
        statistic, rank = self.statistic(score)
        if score.count == 0 or rank == 0:
            return 0.0
        limit = _quantile(self.probability, rank, threshold.score_freedom)
        squares = score.squares / (score.count * threshold.squares_mean)
        count = max(1, round(score.count / threshold.squares_excess))
        most = _quantile(self.probability, count, threshold.windows * count)
        relative = statistic / (rank * threshold.score_excess)  # both have mean 1 in healthy operation
        return max((relative - 1.0) / (limit - 1.0), (squares - 1.0) / (most - 1.0), 0.0)


@lru_cache(maxsize=1024)
def _quantile(probability: float, first: int, second: float) -> float:
    """The value that an F distribution with these degrees of freedom exceeds with this probability."""
    return float(f_distribution.isf(probability, first, second))


def learn_healthy(scores: Sequence[Score], segment: float, false_alarms: float) -> Healthy:
    """Learn healthy operation from the scores of its segments, each of which lasts `segment` [s].

    `false_alarms` is the number allowed a day.
    """
    whole = sum(scores[1:], scores[0])
    uncertainty, _ = inverse(whole.information)
    offset = uncertainty @ whole.score
    lengths = [max(1, round(window / segment)) for window in WINDOWS]
    probability = false_alarms * segment / (DAY * STATISTICS * len(lengths))
    thresholds = []
    for length in lengths:
        windows = [
            sum(scores[i + 1 : i + length], scores[i]) for i in range(0, len(scores) - length + 1, length)
        ]
        excess, ranks, squares = [], [], []
        for one in windows:
            # the offset was fitted to this window, too, so that its residual is smaller than in a later window
            spread = one.information - one.information @ uncertainty @ one.information
            inverted, rank = inverse(spread)
            centred = one.score - one.information @ offset
            excess.append(float(centred @ inverted @ centred))
            ranks.append(rank)
            squares.append(one.squares / max(one.count, 1))
        freedom = float(max(sum(ranks), 1))
        count = float(np.mean([one.count for one in windows]))
        mean = float(np.mean(squares))
        # variance of a mean of `count` independent squares is 2 mean² / count
        scattered = float(np.var(squares, ddof=1)) * count / (2.0 * mean**2) if len(squares) > 1 else 1.0
        thresholds.append(
            Threshold(
                length, len(windows), max(1.0, sum(excess) / freedom), freedom, mean, max(1.0, scattered)
            )
        )
    return Healthy(offset, uncertainty, tuple(thresholds), probability)
