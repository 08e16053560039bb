"""Interpolation of missing samples by a cubic through four neighbours, and its error."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def interpolation_errors(value: Array, missing: NDArray[np.int64]) -> Array:
    """rms error (m,) at the middle of `missing` (m,) samples of a cubic through two samples on either side.

    It is measured on the existing samples (n,); infinite where they are too few. For white noise it is about the
    noise level.
    """
    most = min(int(missing.max(initial=0)), len(value) // 4)  # for longer gaps there are too few samples
    found = np.full(most + 2, np.inf)
    found[0] = 0.0
    for count in range(1, most + 1):
        reach = count + 3  # from the first to the last of the four
        if len(value) < 4 * reach:
            break
        middle = 1 + (count + 1) // 2
        nodes = np.array([0.0, 1.0, count + 2.0, count + 3.0])
        weights = _lagrange(nodes, float(middle))
        told = sum(
            w * value[int(k) : len(value) - reach + int(k)] for w, k in zip(weights, nodes, strict=True)
        )
        error = value[middle : len(value) - reach + middle] - told
        found[count] = float(np.sqrt(np.mean(error**2)))
        if found[count] > np.std(value):
            break  # longer gaps are worse
    return found[np.minimum(missing, most + 1)]


def _lagrange(nodes: Array, at: float) -> Array:
    """Weights (n,) of the values at the nodes in the interpolating polynomial at one position."""
    apart = at - nodes
    return np.array(
        [np.prod(np.delete(apart, k)) / np.prod(nodes[k] - np.delete(nodes, k)) for k in range(len(nodes))]
    )


def cubic(time: Array, value: Array, at: Array) -> Array:
    """The polynomial through at most four samples, at the times `at` (n,)."""
    return np.array([_lagrange(time, float(t)) @ value for t in at])
