"""Rows of an effort balance: selection of a motion's samples, and interpolation of signals between samples."""

import math

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.noise import runs

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
NEIGHBOURS = np.arange(-2, 4)  # offsets of the samples for interpolation between two samples (Lagrange)


def stuck(slow: Mask, memory: float) -> Mask:
    """Samples (n,) to leave out: all `slow` ones, and those within half the filter's `memory` [samples] of a rest
    of that length, because the filter spreads the friction force of the rest to them."""
    out, half = slow.copy(), math.ceil(0.5 * memory)
    for part in runs(slow):
        first, end = part.start, part.stop
        if end - first >= memory:
            out[max(first - half, 0) : end + half] = True
    return out


def sampled(signal: Array, places: NDArray[np.int64], shift: float) -> Array:
    """Values of a signal (n,) or (n, p) at places moved by `shift` samples."""
    whole = math.floor(shift)
    if shift == whole:
        return signal[np.clip(places + whole, 0, len(signal) - 1)]
    between = shift - whole
    weights = [
        math.prod(
            (between - other) / (node - other) for other in NEIGHBOURS.tolist() if other != node
        )
        for node in NEIGHBOURS.tolist()
    ]  # fmt: skip
    total = np.zeros((len(places), *signal.shape[1:]))
    for node, weight in zip(NEIGHBOURS.tolist(), weights, strict=True):
        total += weight * signal[np.clip(places + whole + node, 0, len(signal) - 1)]
    return total
