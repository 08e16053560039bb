"""Number of significant harmonics: a test of |Ĥ_m|² against its own variance, with a stated rate of false alarms."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import f as f_distribution

from rhythmid.ltp.harmonic_estimate import HarmonicEstimate, Significance

TOO_LARGE = 0.01  # probability that the chosen M is too large


def significance(
    functions: Sequence[HarmonicEstimate], every: int = 1, false_alarm: float = TOO_LARGE
) -> tuple[Significance, ...]:
    """Test each pair ±m, m = 1 … M: with Gaussian noise alone, the mean of |Ĥ_m|²/std² is F-distributed.

    Only every `every`-th point is used, where neighbouring points come from the same data. The thresholds share
    `false_alarm` among all pairs (Bonferroni). Functions without a point are not significant.
    """
    highest = max(one.m for one in functions)
    found = []
    for m in range(1, highest + 1):
        pair = [one for one in functions if abs(one.m) == m]
        value = np.concatenate([one.value[::every] for one in pair])
        std = np.concatenate([one.std[::every] for one in pair])
        freedom = np.concatenate([one.freedom[::every] for one in pair])
        p_value = 1.0
        if len(value):
            # with f degrees of freedom the mean ratio is f / (f − 1)
            ratio = np.abs(value) ** 2 / np.maximum(std, 1e-300) ** 2 * (freedom - 1.0) / freedom
            pooled = max(float(freedom.mean()), 0.5 * len(value))
            p_value = float(f_distribution.sf(ratio.mean(), 2 * len(value), 2 * pooled))
        found.append(Significance(m, p_value, false_alarm / highest))
    return tuple(found)


def chosen(tests: Sequence[Significance]) -> int:
    """The largest significant m; 0 if there is none."""
    return max((test.m for test in tests if test.visible), default=0)
