"""Standard deviations where what a fit leaves is no stationary noise: a delay that wanders, noise that grows with the motion, a small
effect that the model lacks.

The Fisher information takes whitened residuals for independent and alike. A residual that keeps its sign along a sensitivity for
longer than the noise remembers moves an estimate by more than that. The scores of contiguous blocks tell by how much: where
the residuals are what they are taken for, they scatter as the information says
(H. White, Econometrica 48 (1980) 817; by blocks: K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rhythmid.identify.covariance import covariance_of
from rhythmid.identify.inverse_dynamics.estimate import EffortFit
from rhythmid.identify.output_error import Fit
from rhythmid.identify.student import weights_of

Array = NDArray[np.float64]
# blocks of all records together: so many that a standard deviation from them is known to a ninth, 1/sqrt(2 BLOCKS), and so few
# that each outlasts what is not noise
BLOCKS = 40
# chance that the blocks of white noise scatter by more: what they scatter by less says nothing against the information
CHANCE = 0.025


def widening(columns: Array, residual: Array, records: Sequence[slice], inverse: Array, std: Array) -> Array:
    """Factors (p,) by which standard deviations have to be larger, 1 where the scores of blocks scatter by no more than chance lets them.

    Parameters
    ----------
    columns : (n, p) sensitivities of the residual, in units of the noise.
    residual : (n,) in the same units.
    records : rows of each record, which has its share of the blocks.
    inverse : (p, p) inverse of the information, `columns` with themselves and what priors add.
    std : (p,) standard deviations without the blocks.
    """
    # by each block: of the estimates, and of their variances where the residual is white
    moved, share = [], []
    for rows in records:
        count = max(1, round(BLOCKS * (rows.stop - rows.start) / max(len(residual), 1)))
        for part in np.array_split(np.arange(rows.start, rows.stop), count):
            moved.append((residual[part] @ columns[part]) @ inverse)
            share.append(np.sum((columns[part] @ inverse) ** 2, axis=0))
    lost = len(inverse)  # with every parameter that is fitted the scores sum to zero once more
    if not lost or len(moved) <= lost:
        return np.ones(lost)
    variance = np.sum(np.square(moved), axis=0) * len(moved) / (len(moved) - lost)
    # a variance may be larger than what can be squared, or nothing where the records say nothing of a parameter
    most = np.max(share, axis=0)
    part_of_most = np.divide(share, most, out=np.ones_like(share), where=most > 0.0)
    freedom = np.sum(part_of_most, axis=0) ** 2 / np.sum(np.square(part_of_most), axis=0)
    ratio = variance / std**2
    return np.where(ratio * freedom > chi2.isf(CHANCE, freedom), np.sqrt(np.maximum(ratio, 1.0)), 1.0)


def with_robust_covariance(fit: Fit) -> Fit:
    """The fit of a free run with standard deviations that its blocks' scores bear out, and its correlations as they are.

    The information is that of the sensitivities: what else has widened the fit's covariance says nothing of the scores.
    """
    line = fit.linearisation
    inverse = covariance_of(line.jacobian, [fit.model.parameters[name].prior for name in fit.names])
    known = np.isfinite(np.diag(inverse)) & np.isfinite(np.diag(fit.covariance))
    known &= np.diag(fit.covariance) > 0.0
    std = np.sqrt(np.diag(fit.covariance)[known])
    factors = np.ones(len(known))
    factors[known] = widening(
        line.jacobian[:, known], line.residual, line.pieces, inverse[np.ix_(known, known)], std
    )
    return replace(fit, covariance=fit.covariance * np.outer(factors, factors))


def with_robust_std(fit: EffortFit, record: NDArray[np.int64]) -> EffortFit:
    """The fit of an effort with standard deviations that its blocks' scores bear out; `record` (n,) is that of each row."""
    rows = weighted(fit)
    ends = np.flatnonzero(np.diff(record, append=-1)) + 1
    records = [slice(int(a), int(b)) for a, b in zip((0, *ends[:-1]), ends, strict=True)]
    std = fit.std.copy()
    std[rows.inside] *= widening(rows.columns, rows.residual, records, rows.inverse, std[rows.inside])
    return replace(fit, std=std)


@dataclass(frozen=True, eq=False)
class Weighted:
    """The rows of an effort in units of their noise, as the last step of the fit weighted them.

    `inside` (p,) marks the parameters that are estimated, of which `columns` (n, q) are the sensitivities and `inverse` (q, q) the inverse
    of their information with the priors'; `residual` (n,) is predicted less measured.
    """

    inside: NDArray[np.bool_]
    columns: Array
    residual: Array
    inverse: Array


def weighted(fit: EffortFit, correlation: float = 1.0) -> Weighted:
    """The fit's rows, of which neighbours repeat one another for `correlation` rows."""
    inside = ~fit.at_limit & (fit.std > 0.0)
    root = root_weights(fit, correlation)
    columns = fit.jacobian[:, inside] * root[:, None]
    information = columns.T @ columns + np.diag(fit.precision[inside])
    scaling = 1.0 / np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information * np.outer(scaling, scaling)) * np.outer(scaling, scaling)
    return Weighted(inside, columns, fit.residual * root, inverse)


def root_weights(fit: EffortFit, correlation: float = 1.0) -> Array:
    """Inverse standard deviation (n,) of each row's noise."""
    return np.sqrt(weights_of(fit.residual, fit.scale) / correlation) / fit.scale
