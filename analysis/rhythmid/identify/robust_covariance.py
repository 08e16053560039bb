"""Standard deviations for residuals that are not stationary noise: a varying delay, noise that grows with the
motion, or a small missing effect.

The Fisher information assumes independent, identically distributed whitened residuals. A residual that keeps its
sign along a sensitivity for longer than the noise's memory moves an estimate by more. The scores of contiguous
blocks measure this: if the assumption holds, their scatter agrees with the information (H. White, Econometrica 48
(1980) 817; by blocks: K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).
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
# blocks of all records together: enough to know a standard deviation to a ninth, 1/sqrt(2 BLOCKS), and so few that
# each is longer than the correlation of the residuals
BLOCKS = 40
# probability of a larger scatter of blocks of white noise: a smaller scatter is no evidence against the information
CHANCE = 0.025


def widening(columns: Array, residual: Array, records: Sequence[slice], inverse: Array, std: Array) -> Array:
    """Factors (p,) by which standard deviations must be increased; 1 where the scores of blocks scatter within chance.

    Parameters
    ----------
    columns : (n, p) sensitivities of the residual, in units of the noise.
    residual : (n,) in the same units.
    records : rows of each record; each gets its share of the blocks.
    inverse : (p, p) inverse of the information, from `columns` and priors.
    std : (p,) standard deviations without the block scores.
    """
    # scores of each block for the estimates, and their expected variances for white residuals
    moved, share = [], []
    for rows in records:
        count = max(1, round(BLOCKS * (rows.stop - rows.start) / max(len(residual), 1)))
        for part in np.array_split(np.arange(rows.start, rows.stop), count):
            moved.append((residual[part] @ columns[part]) @ inverse)
            share.append(np.sum((columns[part] @ inverse) ** 2, axis=0))
    lost = len(inverse)  # each fitted parameter makes the sum of its scores zero
    if not lost or len(moved) <= lost:
        return np.ones(lost)
    variance = np.sum(np.square(moved), axis=0) * len(moved) / (len(moved) - lost)
    # a variance may be too large to square, or infinite where a parameter is not identifiable
    most = np.max(share, axis=0)
    part_of_most = np.divide(share, most, out=np.ones_like(share), where=most > 0.0)
    freedom = np.sum(part_of_most, axis=0) ** 2 / np.sum(np.square(part_of_most), axis=0)
    ratio = variance / std**2
    return np.where(ratio * freedom > chi2.isf(CHANCE, freedom), np.sqrt(np.maximum(ratio, 1.0)), 1.0)


def with_robust_covariance(fit: Fit) -> Fit:
    """The fit of a free run with standard deviations confirmed by its blocks' scores; correlations are unchanged.

    Only the information of the sensitivities is compared: other terms that have widened the covariance do not
    affect the scores.
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
    """The effort fit with standard deviations confirmed by its blocks' scores; `record` (n,) is the record of each
    row."""
    rows = weighted(fit)
    ends = np.flatnonzero(np.diff(record, append=-1)) + 1
    records = [slice(int(a), int(b)) for a, b in zip((0, *ends[:-1]), ends, strict=True)]
    std = fit.std.copy()
    std[rows.inside] *= widening(rows.columns, rows.residual, records, rows.inverse, std[rows.inside])
    return replace(fit, std=std)


@dataclass(frozen=True, eq=False)
class Weighted:
    """The rows of an effort fit in units of their noise, with the weights of its last step.

    `inside` (p,) marks the estimated parameters. `columns` (n, q) are their sensitivities, `inverse` (q, q) the
    inverse of the information including priors. `residual` (n,) is predicted minus measured effort.
    """

    inside: NDArray[np.bool_]
    columns: Array
    residual: Array
    inverse: Array


def weighted(fit: EffortFit, correlation: float = 1.0) -> Weighted:
    """The fit's rows, weighted for a correlation of neighbouring rows over `correlation` rows."""
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
