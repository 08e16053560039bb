"""Standard deviations where what a fit leaves is no stationary noise: a delay that wanders, noise that grows with the motion, a small
effect that the model lacks.

The Fisher information takes whitened residuals for independent and alike. A residual that keeps its sign along a sensitivity for
longer than the noise remembers moves an estimate by more than that. The scores of contiguous blocks tell by how much: where
the residuals are what they are taken for, they scatter as the information says
(H. White, Econometrica 48 (1980) 817; by blocks: K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.covariance import covariance_of
from rhythmid.identify.inverse_dynamics.estimate import EffortFit
from rhythmid.identify.output_error import Fit
from rhythmid.identify.student import weights_of

Array = NDArray[np.float64]
# blocks of all records together: so many that a standard deviation from them is known to a ninth, 1/sqrt(2 BLOCKS), and so few
# that each outlasts what is not noise
BLOCKS = 40


def scattered(scores: Array, records: Sequence[slice], inverse: Array) -> Array:
    """Standard deviations (p,) of estimates, from the scatter of their scores over blocks; zero where the blocks are too few.

    Parameters
    ----------
    scores : (n, p) gradient of each row's negative log likelihood at the estimate.
    records : rows of each record, which has its share of the blocks.
    inverse : (p, p) inverse of the sum of the rows' information.
    """
    sums = []
    for rows in records:
        count = max(1, round(BLOCKS * (rows.stop - rows.start) / max(len(scores), 1)))
        sums += [part.sum(axis=0) for part in np.array_split(scores[rows], count)]
    freedom = len(sums) - len(inverse)  # with every parameter that is fitted the scores sum to zero once more
    if freedom < 1 or not len(inverse):
        return np.zeros(len(inverse))
    moved = np.array(sums) @ inverse
    return np.sqrt(np.sum(moved**2, axis=0) * len(sums) / freedom)


def with_robust_covariance(fit: Fit) -> Fit:
    """The fit of a free run with standard deviations of at least what its blocks' scores say, and its correlations as they are.

    The information is that of the sensitivities: what else has widened the fit's covariance says nothing of the scores.
    """
    line = fit.linearisation
    inverse = covariance_of(line.jacobian, [fit.model.parameters[name].prior for name in fit.names])
    known = np.isfinite(np.diag(inverse)) & np.isfinite(np.diag(fit.covariance))
    known &= np.diag(fit.covariance) > 0.0
    scores = line.jacobian[:, known] * line.residual[:, None]
    std = np.sqrt(np.diag(fit.covariance)[known])
    factors = np.ones(len(known))
    factors[known] = np.maximum(scattered(scores, line.pieces, inverse[np.ix_(known, known)]) / std, 1.0)
    return replace(fit, covariance=fit.covariance * np.outer(factors, factors))


def with_robust_std(fit: EffortFit, record: NDArray[np.int64]) -> EffortFit:
    """The fit of an effort with standard deviations of at least what its blocks' scores say; `record` (n,) is that of each row."""
    weight = weights_of(fit.residual, fit.scale) / fit.scale**2
    inside = ~fit.at_limit
    columns = fit.jacobian[:, inside]
    information = (columns * weight[:, None]).T @ columns + np.diag(fit.precision[inside])
    scaling = 1.0 / np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information * np.outer(scaling, scaling)) * np.outer(scaling, scaling)
    ends = np.flatnonzero(np.diff(record, append=-1)) + 1
    records = [slice(int(a), int(b)) for a, b in zip((0, *ends[:-1]), ends, strict=True)]
    std = fit.std.copy()
    scores = columns * (weight * fit.residual)[:, None]
    std[inside] = np.maximum(std[inside], scattered(scores, records, inverse))
    return replace(fit, std=std)
