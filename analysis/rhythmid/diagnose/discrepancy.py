"""Parameter errors caused by small effects that a model lacks.

Every model lacks small effects: they are too small to be named, or the catalogue does not contain them. They bias the
estimated parameters, and the scatter of the residual does not show it. The model's discrepancy (M. C. Kennedy,
A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425) is therefore modelled as a random sum of the effects of the catalogue's
candidates and of free functions of the motion. Each has its own size, normal about zero; all sizes have a common scale.

An effect counts as small if the model's parameters do not reproduce much of it: only that part is visible in the residual. The
part that they reproduce, such as most of a quadratic drag beside a viscous damper, may be large. All effects therefore have the
same expected visible part, not the same force.

The residual informs about the scale but does not fix it: an effect that it hardly shows may still be present. The scale is
therefore integrated out, with a half-Cauchy prior whose median is one standard deviation of the noise
(A. Gelman, Bayesian Analysis 1 (2006) 515).
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.least_squares import orthonormal, reduced

Array = NDArray[np.float64]
# grid of the common scale of the candidates' sizes, in standard deviations of the noise, six values a decade: from a hundredth
# of the noise in one direction to far beyond any residual
SCALES = np.logspace(-2.0, 6.0, 49)
ROWS = 20_000  # rows processed at once
# share of a candidate's response outside the parameters' span up to which the two are observationally equivalent: the estimate then
# means both together
ABSORBED = 1e-3
ROUNDING = 1e-6  # share of the visible parts below which a direction is rounding


def mean_product(jacobian: Array, residual: Array, candidates: Array, inverse: Array) -> Array:
    """Mean product (p, p) of the parameter errors that are due to effects which the model lacks.

    Parameters
    ----------
    jacobian : (n, p) sensitivities of the residual to the parameters.
    residual : (n,) predicted less measured, in units of its noise.
    candidates : (n, m) changes of the prediction by effects that the model may lack, each of arbitrary size.
    inverse : (p, p) inverse of the parameters' information matrix (jacobianᵀ jacobian plus the precision of the priors).

    Returns
    -------
    float64[p, p]
        Mean product of errors, in the products of the parameters' units.
    """
    rows, parameters = jacobian.shape
    parts = (slice(first, first + ROWS) for first in range(0, rows, ROWS))
    design, residual = reduced((np.hstack([jacobian[s], candidates[s]]), residual[s]) for s in parts)
    jacobian, candidates = design[:, :parameters], design[:, parameters:]
    basis = orthonormal(jacobian)
    left = candidates - basis @ (basis.T @ candidates)
    whole, visible = np.linalg.norm(candidates, axis=0), np.linalg.norm(left, axis=0)
    shows = visible > ABSORBED * whole
    columns, left = candidates[:, shows] / visible[shows], left[:, shows] / visible[shows]
    rest = residual - basis @ (basis.T @ residual)
    free = rows - basis.shape[1] - left.shape[1]
    if free <= 0 or not left.shape[1]:
        return np.zeros_like(inverse)
    # along these directions the residual contains missing effects and noise, elsewhere noise only
    directions, strengths, mixing = np.linalg.svd(left, full_matrices=False)
    seen = strengths > ROUNDING
    shown, strengths = -(directions[:, seen].T @ rest), strengths[seen]
    # the remainder may exceed the assumed noise, and neighbouring rows may be correlated; both reduce the information
    noise = max((float(rest @ rest) - float(shown @ shown)) / free, 1.0)
    moved = inverse @ (jacobian.T @ columns)
    scales = np.sqrt(noise) * SCALES
    found = np.zeros_like(inverse)
    for scale, weight in zip(scales, _weights(shown, strengths, noise), strict=True):
        share = scale**2 * strengths / (noise + scale**2 * strengths**2)
        mean = mixing[seen].T @ (share * shown)
        # a direction that the parameters absorb completely is left to them
        spread = (mixing[seen].T * (scale**2 * (1.0 - share * strengths))) @ mixing[seen]
        found += weight * (moved @ (spread + np.outer(mean, mean)) @ moved.T)
    return found


def _weights(shown: Array, strengths: Array, noise: float) -> Array:
    """Posterior probabilities (s,) of the common scales `SCALES`, each for an equal interval of its logarithm."""
    variance = noise * (1.0 + SCALES[:, None] ** 2 * strengths**2)
    log_density = -0.5 * np.sum(np.log(variance) + shown**2 / variance, axis=1)
    log_density += np.log(SCALES / (1.0 + SCALES**2))
    weights = np.exp(log_density - log_density.max())
    return np.asarray(weights / weights.sum())
