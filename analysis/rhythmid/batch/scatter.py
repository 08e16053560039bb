"""Whether repeated estimates agree: their scatter compared with their stated standard deviations.

All tests rest on one model: x_i = (X b)_i + r_i + e_i with e_i ~ N(0, s_i²) stated and r_i ~ N(0, τ²) from run to run. X holds a mean, a mean for
each group, or such means and a slope. With only the stated noise each p-value is uniform, whatever the number of runs.

W. G. Cochran, Biometrics 10 (1954) 101 (Q); R. T. Birge, Phys. Rev. 40 (1932) 207 (ratio); R. C. Paule and J. Mandel, J. Res. NBS 87 (1982) 377
(τ); G. Knapp and J. Hartung, Stat. Med. 22 (2003) 2693 (slope); S. Holm, Scand. J. Stat. 6 (1979) 65 (several tests at once).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar
from scipy.stats import chi2, f, t

Array = NDArray[np.float64]
EXACT = 1e-12  # share of their own size below which residuals are rounding


@dataclass(frozen=True)
class Fit:
    """Weighted least squares: coefficients (p,), their covariance (p, p), the weighted sum of squares Q that is left and its degrees of freedom."""

    coefficients: Array
    covariance: Array
    left: float
    freedom: int


@dataclass(frozen=True)
class Slope:
    """A linear trend: the change per unit of time, its standard error, the p-value of no trend, and its degrees of freedom."""

    value: float
    std: float
    p_value: float
    freedom: int

    @property
    def half(self) -> float:
        """Half of the 95 % interval."""
        return float(t.ppf(0.975, self.freedom)) * self.std


@dataclass(frozen=True)
class Mean:
    """Mean of a random-effects model; `between` (τ) is the scatter beyond the stated standard deviations."""

    value: float
    std: float
    between: float


def fit(design: Array, values: Array, stds: Array, between: float = 0.0) -> Fit:
    """Weighted least squares of `values` (n,) on the columns of `design` (n, p), with weights 1 / (s_i² + τ²)."""
    root = 1.0 / np.hypot(stds, between)
    scaled, wanted = design * root[:, None], values * root
    coefficients, _, rank, _ = np.linalg.lstsq(scaled, wanted, rcond=None)
    residual = wanted - scaled @ coefficients
    left = float(residual @ residual)
    if left <= EXACT**2 * float(wanted @ wanted):
        left = 0.0
    covariance: Array = np.linalg.pinv(scaled.T @ scaled).astype(np.float64)
    return Fit(coefficients.astype(np.float64), covariance, left, len(values) - int(rank))


def between_runs(design: Array, values: Array, stds: Array) -> float:
    """τ of Paule and Mandel: the scatter that, added to the stated noise, makes Q equal to its degrees of freedom; 0 if Q is already smaller."""

    def excess(between: float) -> float:
        made = fit(design, values, stds, between)
        return made.left - made.freedom

    freedom = fit(design, values, stds).freedom
    if freedom < 1 or excess(0.0) <= 0.0:
        return 0.0
    high = float(np.ptp(values)) or float(np.max(stds))
    while excess(high) > 0.0:
        high *= 2.0
    return float(root_scalar(excess, bracket=(0.0, high), method="brentq").root)


def random_effects(values: Array, stds: Array) -> Mean:
    """Mean over runs that may differ by more than their stated standard deviations."""
    ones = np.ones((len(values), 1))
    between = between_runs(ones, values, stds)
    made = fit(ones, values, stds, between)
    return Mean(float(made.coefficients[0]), math.sqrt(float(made.covariance[0, 0])), between)


def homogeneous(values: Array, stds: Array, groups: Sequence[str]) -> tuple[float, float] | None:
    """Whether the runs of each group agree within their stated intervals: Birge ratio and p-value of Cochran's Q; None without repeated runs."""
    made = fit(_means(groups), values, stds)
    if made.freedom < 1:
        return None
    return math.sqrt(made.left / made.freedom), float(chi2.sf(made.left, made.freedom))


def groups_agree(values: Array, stds: Array, groups: Sequence[str]) -> float | None:
    """p-value of the hypothesis that groups differ no more than their runs do: F of the weighted analysis of variance.

    The reference is the actual scatter of the runs, so that a scatter larger than stated does not make the groups differ. None for one group, or
    without repeated runs.
    """
    design = _means(groups)
    apart = fit(design, values, stds)
    if design.shape[1] < 2 or apart.freedom < 1:
        return None
    between = between_runs(design, values, stds)
    whole, apart = (fit(one, values, stds, between) for one in (np.ones((len(values), 1)), design))
    more = design.shape[1] - 1
    return _f_test(max(whole.left - apart.left, 0.0), more, apart.left, apart.freedom)


def trend(values: Array, stds: Array, groups: Sequence[str], times: Array) -> Slope | None:
    """Common slope of all groups over time, with a mean for each group; None if there are too few runs or times.

    The standard error is scaled by the scatter about the line, and compared with Student's t.
    """
    design = np.column_stack([_means(groups), times - times.mean()])
    if np.linalg.matrix_rank(design) < design.shape[1] or len(values) <= design.shape[1]:
        return None
    made = fit(design, values, stds, between_runs(design, values, stds))
    slope = float(made.coefficients[-1])
    std = math.sqrt(float(made.covariance[-1, -1]) * made.left / made.freedom)
    if std == 0.0:  # all points on one line, which has slope 0 if the values are equal
        return Slope(slope, std, 0.0 if np.ptp(values) else 1.0, made.freedom)
    return Slope(slope, std, float(2.0 * t.sf(abs(slope) / std, made.freedom)), made.freedom)


def holm(p_values: Sequence[float]) -> list[float]:
    """p-values for several tests at once (Holm). The smallest is below α by chance in at most a share α of all cases, whether the tests are dependent or not."""
    order = np.argsort(p_values)
    steps = len(p_values) - np.arange(len(p_values))
    adjusted = np.empty(len(p_values))
    adjusted[order] = np.minimum(np.maximum.accumulate(steps * np.asarray(p_values)[order]), 1.0)
    return adjusted.tolist()


def _means(groups: Sequence[str]) -> Array:
    """A column for each group, 1 in its rows."""
    names = np.array(groups)
    return np.stack([names == name for name in dict.fromkeys(groups)], axis=1).astype(np.float64)


def _f_test(more: float, more_freedom: int, left: float, freedom: int) -> float:
    if left == 0.0:  # the runs of each group are equal
        return 0.0 if more > 0.0 else 1.0
    return float(f.sf((more / more_freedom) / (left / freedom), more_freedom, freedom))
