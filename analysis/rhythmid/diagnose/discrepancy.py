"""What small effects that a model lacks do to the errors of its parameters.

No model is whole. Small effects that are not named, because they are too small or because the catalogue has no name for them, move
the parameters that are estimated without them, and no scatter of the residual shows it. So the model's discrepancy is taken for
a random sum of what the catalogue's candidates and free functions of the motion would do (a discrepancy in the sense of M. C. Kennedy,
A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425, with causes that a machine may have): each with a size of its own, normal about nothing, of a
common scale. The residual tells of that scale and does not fix it: a cause that it hardly shows may be there all the same. So the scale is
integrated over, with a half-Cauchy prior whose median is one standard deviation of the noise (A. Gelman, Bayesian Analysis 1 (2006) 515).
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.least_squares import orthonormal, reduced

Array = NDArray[np.float64]
# common scales of the candidates' sizes that are integrated over, in standard deviations of the noise: from a hundredth of what noise
# itself is worth in one direction to far beyond what any residual holds, six a decade
SCALES = np.logspace(-2.0, 6.0, 49)
ROWS = 20_000  # that are taken at once
ROUNDING = 1e-6  # of a candidate, below which what the parameters leave of it is rounding


def mean_product(jacobian: Array, residual: Array, candidates: Array, inverse: Array) -> Array:
    """Mean product (p, p) of the errors of parameters that come from what the model lacks.

    Parameters
    ----------
    jacobian : (n, p) sensitivities of the residual to the parameters.
    residual : (n,) predicted less measured, in units of its noise.
    candidates : (n, m) changes of the prediction by effects that the model may lack, each of any size.
    inverse : (p, p) inverse of the parameters' information, `jacobian` with itself and what priors add.
    """
    rows, parameters = jacobian.shape
    parts = (slice(first, first + ROWS) for first in range(0, rows, ROWS))
    design, residual = reduced((np.hstack([jacobian[s], candidates[s]]), residual[s]) for s in parts)
    jacobian, candidates = design[:, :parameters], design[:, parameters:]
    size = np.linalg.norm(candidates, axis=0)
    columns = candidates[:, size > 0.0] / size[size > 0.0]
    basis = orthonormal(jacobian)
    left = columns - basis @ (basis.T @ columns)
    rest = residual - basis @ (basis.T @ residual)
    free = rows - basis.shape[1] - left.shape[1]
    if free <= 0 or not left.shape[1]:
        return np.zeros_like(inverse)
    # in these directions the residual is what is missing and noise, in all others noise
    directions, strengths, mixing = np.linalg.svd(left, full_matrices=False)
    seen = strengths > ROUNDING
    shown, strengths = -(directions[:, seen].T @ rest), strengths[seen]
    # what is left may be more than the noise was taken for, and neighbouring rows may repeat one another, so that all are less
    noise = max((float(rest @ rest) - float(shown @ shown)) / free, 1.0)
    moved = inverse @ (jacobian.T @ columns)
    scales = np.sqrt(noise) * SCALES
    found = np.zeros_like(inverse)
    for scale, weight in zip(scales, _weights(shown, strengths, noise), strict=True):
        share = scale**2 * strengths / (noise + scale**2 * strengths**2)
        mean = mixing[seen].T @ (share * shown)
        # a direction that the parameters absorb whole is theirs
        spread = (mixing[seen].T * (scale**2 * (1.0 - share * strengths))) @ mixing[seen]
        found += weight * (moved @ (spread + np.outer(mean, mean)) @ moved.T)
    return found


def _weights(shown: Array, strengths: Array, noise: float) -> Array:
    """Posterior probabilities (s,) of the common scales `SCALES`, each for its equal part of the logarithm."""
    variance = noise * (1.0 + SCALES[:, None] ** 2 * strengths**2)
    log_density = -0.5 * np.sum(np.log(variance) + shown**2 / variance, axis=1)
    log_density += np.log(SCALES / (1.0 + SCALES**2))
    weights = np.exp(log_density - log_density.max())
    return np.asarray(weights / weights.sum())
