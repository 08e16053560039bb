"""Student's t errors: scale, density, weights of reweighted least squares, and autocorrelation time of residuals.

Outliers and effects that no model explains get small weights (K. L. Lange, R. J. A. Little, J. M. G. Taylor, J. Am.
Stat. Assoc. 84 (1989) 881).
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

Array = NDArray[np.float64]
DEGREES = 4.0  # degrees of freedom: the lowest for which the fourth moment is not finite; Lange et al. use 4 where it is not estimated
SETTLES = 20  # largest number of iterations for the scale
HARDLY = 1e-9  # share of the root mean square below which a median only says that most errors are zero
NO_ERROR = 1e-150  # scale where all errors are zero: its square is still a nonzero number
MEDIAN = 0.741  # median of |t| for 4 degrees of freedom and unit scale


def scale_of(error: Array) -> float:
    """Maximum-likelihood scale of errors (n,); `NO_ERROR` where all are zero."""
    square = error**2
    count = len(error)
    rms = math.sqrt(float(np.add.reduce(square)) / count)
    if rms < NO_ERROR:
        return NO_ERROR
    middle = (count - 1) // 2, count // 2
    ranked = np.partition(np.abs(error), middle)
    scale = 0.5 * float(ranked[middle[0]] + ranked[middle[1]]) / MEDIAN
    if scale < HARDLY * rms:  # most errors are zero: use the scale of the others
        scale = rms
    for _ in range(SETTLES):
        terms = (DEGREES + 1.0) * square / (DEGREES + square / scale**2)
        new = math.sqrt(float(np.add.reduce(terms)) / count)
        new = max(new, NO_ERROR)
        if abs(new - scale) < 1e-3 * scale:
            return new
        scale = new
    return scale


def weights_of(error: Array, scale: float) -> Array:
    """Weights (n,) of reweighted least squares."""
    return (DEGREES + 1.0) / (DEGREES + (error / scale) ** 2)


def log_density(error: Array, scale: float) -> Array:
    """Logarithm of the density (n,) of errors (n,) at this scale."""
    constant = gammaln(0.5 * (DEGREES + 1.0)) - gammaln(0.5 * DEGREES) - 0.5 * math.log(DEGREES * math.pi)
    return constant - math.log(scale) - 0.5 * (DEGREES + 1.0) * np.log1p((error / scale) ** 2 / DEGREES)


def cost_of(error: Array, scale: float) -> float:
    """Negative log likelihood of errors (n,) at this scale, up to a constant."""
    return len(error) * math.log(scale) + 0.5 * (DEGREES + 1.0) * float(
        np.sum(np.log1p((error / scale) ** 2 / DEGREES))
    )


def autocorrelation_time(error: Array, record: NDArray[np.int64]) -> float:
    """Integrated autocorrelation time [rows] of errors (n,), at least 1; `record` (n,) is the record of each row.

    Neighbouring autocorrelations are summed while their sum is positive and falls (C. J. Geyer, Statistical Science 7 (1992) 473).
    """
    parts = [part - part.mean() for k in np.unique(record) if len(part := error[record == k]) > 8]
    power = sum(float(part @ part) for part in parts)
    if power == 0.0:
        return 1.0
    rho = np.zeros(max(map(len, parts)))
    for part in parts:
        spectrum = np.abs(np.fft.rfft(part, 2 * len(part))) ** 2
        rho[: len(part)] += np.fft.irfft(spectrum, 2 * len(part))[: len(part)] / power
    total, least = 0.0, math.inf
    for pair in rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1):
        least = min(least, float(pair))
        if least <= 0.0:
            break
        total += least
    return max(2.0 * total - 1.0, 1.0)
