"""What a fitted path of a joint leaves of its effort, and the effects of other causes on it, in units of the joint's noise."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.least_squares import orthonormal
from rhythmid.identify.student import autocorrelation_time, scale_of, weights_of

Array = NDArray[np.float64]


def in_units_of_noise(
    residual: Array, columns: Array, beside: Array, record: NDArray[np.int64], noise: Array | None = None
) -> tuple[Array, Array]:
    """A residual (n,) and columns (n, k) in units of the noise, with the columns `beside` (n, p) of other parameters projected out.

    The `noise` (n,) is the residual itself unless that of a better model is given; `record` (n,) is the record of each row.
    """
    noise = residual if noise is None else noise
    scale = scale_of(noise)
    lasts = autocorrelation_time(noise, record)
    root = np.sqrt(weights_of(noise, scale) / lasts) / scale
    basis = orthonormal(beside * root[:, None])

    def without(signal: Array) -> Array:
        return signal - basis @ (basis.T @ signal)

    return without(root * residual), without(root[:, None] * columns)
