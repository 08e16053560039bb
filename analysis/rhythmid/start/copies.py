"""Channels that are the output once more, such as one sensor in volts and in millimetres: they drive nothing."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.inventory import Recorded
from rhythmid.start.relation import together

Array = NDArray[np.float64]
SAME = 0.999  # correlation at once from which a channel may be the output in another unit
SAME_STEPS = 0.99  # the same of their steps: what merely goes along has noise of its own


def correlation_of_copy(one: Recorded, output: Recorded) -> float:
    """Correlation with the output at the same time where the channel is an affine copy of it, noise and all; else 0.

    Rounding spoils the steps of a copy; then it is one where the two differ by no more than what they are rounded to.
    """
    _, first, second = together(one, output)
    if not len(first):
        return 0.0
    at_once = _correlation(first, second)
    if abs(at_once) <= SAME:
        return 0.0
    slope, offset = np.polyfit(first, second, 1)
    apart = float(np.std(second - slope * first - offset))
    rounded = abs(slope) * _resolution(one) + _resolution(output)
    steps = _correlation(np.diff(first), np.diff(second))
    return at_once if apart <= rounded or abs(steps) > SAME_STEPS else 0.0


def note_of_copy(one: Recorded, correlation: float) -> str:
    """What to tell of a copy that is left out."""
    return (
        f"{one} is a copy of the output (correlation {correlation:+.5f} at once), in another unit or by another sensor: "
        "it drives nothing"
    )


def doubt_of_copy(correlation: float) -> str:
    """What is doubtful about a copy that its name says to drive."""
    return (
        f"it is a copy of the output (correlation {correlation:+.5f} at once): what a controller makes while its reference "
        "stands still, or the same motion in another unit"
    )


def _resolution(one: Recorded) -> float:
    """What the values are rounded to, if they are: the smallest difference between two of them."""
    steps = np.diff(np.unique(one.value[np.isfinite(one.value)]))
    return float(steps.min()) if len(steps) else 0.0


def _correlation(first: Array, second: Array) -> float:
    if np.ptp(first) == 0.0 or np.ptp(second) == 0.0:
        return 0.0
    return float(np.corrcoef(first, second)[0, 1])
