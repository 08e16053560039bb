"""Nonuniform noise: relative standard deviation of block averages under timestamp jitter."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.stamp_jitter import stamp_jitter

Array = NDArray[np.float64]


def relative_spreads(stretches: Sequence[tuple[str, Array, Array]], block: int) -> list[Array | None]:
    """Standard deviation of the noise of each average over `block` samples, relative to its root mean square; (n //
    block,) per stretch.

    A stretch is the name of its record, its timestamps (n,) [s] and its samples (n,). The jitter is estimated from
    all stretches of a record. None where no jitter is detected, so that all averages have equal weight.
    """
    jitter = {
        name: stamp_jitter([(time, value) for whole, time, value in stretches if whole == name])
        for name in dict.fromkeys(whole for whole, _, _ in stretches)
    }
    found: list[Array | None] = []
    for whole, time, value in stretches:
        shown = jitter[whole]
        if shown is None:
            found.append(None)
            continue
        count = len(time) // block
        square = shown.relative(time, value)[: count * block] ** 2
        square = square.reshape(count, block).mean(axis=1)
        found.append(np.sqrt(square / square.mean()))
    return found
