"""Parameter errors caused by small effects that a model lacks.

Every model lacks small effects: they are too small to be named, or the catalogue does not contain them. They bias the
estimated parameters, and the scatter of the residual does not show it. The model's discrepancy (M. C. Kennedy,
A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425) is therefore modelled as a random sum of the effects of the catalogue's
candidates and of free functions of the motion. Each has its own size, normal about zero; all sizes have a common scale.

An effect counts as small if the model's parameters do not reproduce much of it: only that part is visible in the residual. The
part that they reproduce, such as most of a quadratic drag beside a viscous damper, may be large. All effects therefore have the
same expected visible part, not the same force, as long as the whole effect stays within what models of real machines leave: of a
law that the parameters reproduce to a hundredth, nothing visible says how large it is.

The residual informs about the scale but does not fix it: an effect that it hardly shows may still be present. The scale is
therefore integrated out, with a half-Cauchy prior whose median is one standard deviation of the noise
(A. Gelman, Bayesian Analysis 1 (2006) 515).
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.constants import LEFT
from rhythmid.identify.least_squares import orthonormal, reduced

Array = NDArray[np.float64]
# grid of the common scale of the candidates' sizes, in standard deviations of the noise, six values a decade: from a hundredth
# of the noise in one direction to far beyond any residual
SCALES = np.logspace(-2.0, 6.0, 49)
ROWS = 20_000  # rows processed at once
# share of a candidate's response outside the parameters' span up to which the two are observationally equivalent: the estimate then
# means both together
ABSORBED = 1e-3


def mean_product(jacobian: Array, residual: Array, candidates: Array, inverse: Array, signal: float) -> Array:
    """Mean product (p, p) of the parameter errors that are due to effects which the model lacks.

    Parameters
    ----------
    jacobian : (n, p) sensitivities of the residual to the parameters.
    residual : (n,) predicted less measured, in units of its noise.
    candidates : (n, m) changes of the prediction by effects that the model may lack, each of arbitrary size.
    inverse : (p, p) inverse of the parameters' information matrix (jacobianᵀ jacobian plus the precision of the priors).
    signal : norm of what was measured, about its mean, in units of the residual's noise; a whole effect is about `LEFT` of it at most.

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
    if free <= 0 or not left.shape[1] or signal <= 0.0:
        return np.zeros_like(inverse)
    # rows in as many directions as there are candidates; elsewhere the residual contains noise only
    frame, corner = np.linalg.qr(left)
    shown = -(frame.T @ rest)
    # the remainder may exceed the assumed noise, and neighbouring rows may be correlated; both reduce the information
    noise = max((float(rest @ rest) - float(shown @ shown)) / free, 1.0)
    moved = inverse @ (jacobian.T @ columns)
    most = (
        LEFT * signal * visible[shows] / whole[shows]
    )  # of the visible part, where the whole effect is at its largest
    found, evidence = [], []
    for scale in np.sqrt(noise) * SCALES:
        size = 1.0 / np.hypot(1.0 / scale, 1.0 / most)
        part = corner * size
        variance = noise * np.eye(len(part)) + part @ part.T
        gain = np.linalg.solve(variance, part).T
        mean = gain @ shown
        spread = np.eye(len(size)) - gain @ part
        found.append(moved * size @ (spread + np.outer(mean, mean)) @ (moved * size).T)
        evidence.append(-0.5 * (np.linalg.slogdet(variance)[1] + shown @ np.linalg.solve(variance, shown)))
    log_weights = np.array(evidence) + np.log(SCALES / (1.0 + SCALES**2))  # equal intervals of the logarithm
    weights = np.exp(log_weights - log_weights.max())
    return np.asarray(np.tensordot(weights / weights.sum(), np.array(found), 1), dtype=np.float64)
