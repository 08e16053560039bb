"""Log density of blocks of errors whose scale varies from block to block.

A model's error is seldom as large in slow moves as in fast ones. With one scale for all blocks, a hypothesis that explains
nearly everything in one record and half of a second one would score worse in the second than a hypothesis that explains
nothing. The scale of each block is therefore unknown, log-normal about that of the blocks which the fit saw, and integrated
out by Laplace's method (L. Tierney, J. B. Kadane, J. Am. Stat. Assoc. 81 (1986) 82).
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.student import DEGREES, log_density, scale_of

Array = NDArray[np.float64]
# smallest scale of a block, relative to that of the others: a block with less error, such as a rest, holds nothing to predict
QUIETEST = 0.01
# information of one Student's t error on the logarithm of its scale
INFORMATION = 2.0 * DEGREES / (DEGREES + 3.0)


def block_densities(
    errors: Sequence[Array], scales: Array, time: float, seen: NDArray[np.bool_], least: float = 0.0
) -> Array:
    """Log densities (b,) of blocks of errors, divided by the autocorrelation time.

    Parameters
    ----------
    errors : the errors of each block, b arrays.
    scales : (b,) scale that the fit expects of each block.
    time : autocorrelation time [samples].
    seen : (b,) blocks from which the variation of the scales is estimated; no fit has seen the others.
    least : lower limit of the error scale, such as that of rounding.

    Returns
    -------
    float64[b]
        Log density of each block.
    """
    own = np.array(
        [
            math.log(max(scale_of(one), least, QUIETEST * scale) / scale) if len(one) else 0.0
            for one, scale in zip(errors, scales)
        ]
    )
    information = INFORMATION * np.array([len(one) for one in errors]) / time
    variance = _between(own[seen], information[seen])
    # weight of a block's own scale in the estimate
    share = variance * information / (1.0 + variance * information)
    shift = share * own
    found = np.array(
        [log_density(one, float(scale)).sum() for one, scale in zip(errors, scales * np.exp(shift))]
    )
    departure = shift**2 / (2.0 * variance) if variance > 0.0 else np.zeros(len(shift))
    return found / time - departure - 0.5 * np.log1p(variance * information)


def _between(own: Array, information: Array) -> float:
    """Variance between blocks of the logarithm of their scales (b,), without the variance of its estimates."""
    known = information > 0.0
    if known.sum() < 2:
        return 0.0
    return float(max(np.mean(own[known] ** 2) - np.mean(1.0 / information[known]), 0.0))
