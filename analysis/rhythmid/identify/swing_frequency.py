"""Range of frequencies of a free oscillation: with a nonlinear law they change with the amplitude as it decays."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.motion_band import moving_part
from rhythmid.identify.series import Series

Array = NDArray[np.float64]
# share of the largest amplitude below which cycles are ignored: noise causes random zero crossings
LEAST_SWING_SHARE = 0.1
OUTER = (0.05, 0.95)  # quantiles of the frequencies of all cycles outside which they are taken for errors


def swing_frequencies(series: Sequence[Series]) -> tuple[float, float]:
    """Lowest and highest frequency [Hz] of the cycles of these series, between zero crossings in one direction; (0,
    0) without any."""
    found = np.concatenate([_of_one(moving_part(one.averaged), one.period * one.block) for one in series])
    if not len(found):
        return 0.0, 0.0
    low, high = np.quantile(found, OUTER)
    return float(low), float(high)


def _of_one(value: Array, step: float) -> Array:
    """Frequencies [Hz] (n,) of the cycles of large amplitude of a signal with samples `step` [s] apart."""
    value = value - value.mean()
    before = np.flatnonzero((value[:-1] < 0.0) & (value[1:] >= 0.0))
    if len(before) < 2:
        return np.empty(0)
    times = step * (before - value[before] / (value[before + 1] - value[before]))
    sizes = np.array([np.abs(value[a : b + 1]).max() for a, b in zip(before[:-1], before[1:])])
    return (1.0 / np.diff(times))[sizes > LEAST_SWING_SHARE * np.abs(value).max()]
