"""Whether a motion goes back and forth, so that its positions are met in both directions."""

from collections.abc import Hashable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# share of the travel that a motion passes in its rarer direction, from which on it goes back and forth: a motion in one direction
# whose noise makes its path twice its travel goes back by as much
BOTH_WAYS = 0.5


def goes_back_and_forth(parts: Sequence[Array]) -> bool:
    """Whether the parts of one record, float64[samples] each, together pass at least half of their travel in each direction.

    A single cycle suffices wherever it begins, and so does a motion that ends before it has closed its cycle.
    """
    steps = np.concatenate([np.diff(one) for one in parts])
    up, down = float(steps[steps > 0.0].sum()), -float(steps[steps < 0.0].sum())
    travel = float(np.ptp(np.concatenate(parts)))
    return min(up, down) >= BOTH_WAYS * travel


def some_record_comes_back(parts: Iterable[tuple[Hashable, Array]]) -> bool:
    """Whether the position goes back and forth in some record; each part, float64[samples], comes with what names its record."""
    by_record: dict[Hashable, list[Array]] = {}
    for record, part in parts:
        by_record.setdefault(record, []).append(part)
    return any(map(goes_back_and_forth, by_record.values()))
