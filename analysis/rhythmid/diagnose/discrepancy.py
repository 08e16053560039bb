"""What small effects that a model lacks do to the errors of its parameters.

No model is whole. Small effects that are not named, because they are too small or because the catalogue has no name for them, move
the parameters that are estimated without them, and no scatter of the residual shows it. So the model's discrepancy is taken for
a random sum of what the catalogue's candidates would do (a discrepancy in the sense of M. C. Kennedy, A. O'Hagan, J. R. Stat. Soc. B
63 (2001) 425, with causes that a machine may have): each with a size of its own, normal about nothing, of a common scale.
The scale is that which makes the residual likeliest. Where the residual is noise it is nothing, and nothing is added.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from rhythmid.identify.least_squares import orthonormal, reduced

Array = NDArray[np.float64]
# chance that noise alone makes a scale other than nothing as likely as that: below it nothing is added
CHANCE = 0.05
# decades of the candidates' common scale that are looked through, about the one at which they are as large as the residual
DECADES = 4.0
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
    scale = _scale(shown, strengths, noise)
    if scale == 0.0:
        return np.zeros_like(inverse)
    share = scale**2 * strengths / (noise + scale**2 * strengths**2)
    mean = mixing[seen].T @ (share * shown)
    spread = scale**2 * (np.eye(len(mean)) - (mixing[seen].T * (share * strengths)) @ mixing[seen])
    moved = inverse @ (jacobian.T @ columns)
    return moved @ (spread + np.outer(mean, mean)) @ moved.T


def _scale(shown: Array, strengths: Array, noise: float) -> float:
    """Common scale of the candidates' sizes that makes `shown` likeliest, 0 where noise of this variance does nearly as well."""

    def cost(logarithm: float) -> float:
        variance = noise + math.exp(2.0 * logarithm) * strengths**2
        return 0.5 * float(np.sum(np.log(variance) + shown**2 / variance))

    if not len(shown):
        return 0.0
    about = math.log(math.sqrt(float(shown @ shown)) or 1e-300)
    reach = DECADES * math.log(10.0)
    found: Any = minimize_scalar(cost, bounds=(about - reach, about + reach), method="bounded")
    without = 0.5 * float(np.sum(np.log(noise) + shown**2 / noise))
    # a scale cannot be negative, so half of the chance lies at nothing (S. G. Self, K.-Y. Liang, J. Am. Stat. Assoc. 82 (1987) 605)
    if 2.0 * (without - float(found.fun)) < chi2.isf(2.0 * CHANCE, 1):
        return 0.0
    return math.exp(float(found.x))
