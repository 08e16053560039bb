"""Physical parameters from the magnitudes of HTFs alone, which delays leave unchanged: the paper's equation (8).

|H_m(jω)| = |G_m(jω)|, so the parameters of the undelayed model can be fitted to |Ĥ_m| before the delays are known. The
model's HTFs pass the same smoothing, equation (5), as the data before the two are compared, so the bias of (5)
cancels. Parameters that the HTFs do not depend on, such as the rest length, are determined by the mean of the limit
cycle.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rhythmid.errors import InputError
from rhythmid.ltp.htf import LinearisedModel, linearised
from rhythmid.ltp.regularised_least_squares import HAT, HtfEstimate
from rhythmid.model import Model

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
POOR_MAGNITUDE = 0.5  # relative misfit of the magnitudes above which other starts are tried
FIRST_LOOK = 200  # number of frequencies for a first evaluation
SCAN = np.geomspace(0.4, 2.5, 17)


@dataclass(frozen=True, eq=False)
class MagnitudeFit:
    """A model fitted by equation (8).

    Attributes
    ----------
    model : with the fitted `values` (p,) of the parameters `names` and covariance (p, p); infinite variance where a
        parameter is not identifiable from the magnitudes and the mean.
    linearised : its limit cycle and harmonic state space.
    expected : complex128[h, n] its HTFs after the smoothing of (5), at the estimate's positive frequencies.
    misfit : rms(|Ĝ| − |expected|) / rms(|Ĝ|).
    """

    model: Model
    names: tuple[str, ...]
    values: Array
    covariance: Array
    linearised: LinearisedModel
    expected: Complex
    misfit: float

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each fitted parameter."""
        return {name: math.sqrt(max(v, 0.0)) for name, v in zip(self.names, np.diag(self.covariance))}


def undelayed_parameters(model: Model) -> list[str]:
    """Free parameters other than those of transport delays, noise and rounding, on which no magnitude depends."""
    shown = {term.label for term in model.terms if term.element.kernel is not None} | {"inertia"}
    return [name for name in model.free if name.rsplit(".", 1)[0] in shown]


class _Comparison:
    """Weighted differences of magnitudes, and of the limit cycle's mean, as functions of the parameters."""

    def __init__(self, estimate: HtfEstimate, model: Model, names: list[str]) -> None:
        self.estimate, self.model, self.names = estimate, model, names
        self.operator = estimate.operator
        self.keep = self.operator.positive
        self.measured = np.abs(estimate.htf.value)
        assert estimate.htf.std is not None
        spread = np.where(estimate.reached, estimate.htf.std, np.inf)
        self.weight = spread.min() / spread
        self.size = float(np.sqrt(np.mean((self.weight * self.measured) ** 2)))
        cycle = self.operator.spectra.cycle
        self.mean = float(cycle[0].real)
        motion = float(np.abs(cycle[1:]).max(initial=0.0)) or 1.0
        # the mean is known so accurately that it must be matched; its weight must not spoil the conditioning either
        self.mean_weight = self.size * math.sqrt(self.measured.size) / (1e-2 * motion)
        self.guess: Array | None = None
        self.latest: tuple[Array, Array] | None = None

    def linearised(self, values: Array) -> LinearisedModel:
        changed = self.model.with_values(dict(zip(self.names, values)))
        found = linearised(changed, self.operator.spectra.pumping, self.guess)
        self.guess = found.cycle.states[0]
        return found

    def expected(self, model: LinearisedModel) -> Complex:
        return self.operator.smooth(self.operator.model_htf(model.htf))[:, self.keep]

    def residual(self, values: Array) -> Array:
        """Weighted differences (h n + 1,); huge where the model has no limit cycle."""
        if self.latest is not None and np.array_equal(self.latest[0], values):
            return self.latest[1]
        found = self._residual(values)
        self.latest = values.copy(), found
        return found

    def _residual(self, values: Array) -> Array:
        try:
            model = self.linearised(values)
        except InputError:
            self.guess = None
            return np.full(self.measured.size + 1, 10.0 * self.size)
        difference = self.weight * (np.abs(self.expected(model)) - self.measured)
        mean = float(model.cycle.harmonics(0)[0].real) - self.mean
        return np.append(difference.ravel(), self.mean_weight * mean)

    def jacobian(self, values: Array) -> Array:
        base = self.residual(values)
        columns = []
        for i, value in enumerate(values):
            step = 1e-5 * (abs(value) if value != 0.0 else 1.0)
            if value + step > self.model.parameters[self.names[i]].bounds[1]:
                step = -step
            moved = values.copy()
            moved[i] += step
            columns.append((self._residual(moved) - base) / step)
        return np.stack(columns, axis=1)

    def rough(self, values: Array) -> float:
        """Relative misfit of the magnitudes at some of the frequencies, without the smoothing, for a first evaluation."""
        try:
            model = self.linearised(values)
        except InputError:
            self.guess = None
            return math.inf
        some = slice(None, None, max(1, self.measured.shape[1] // FIRST_LOOK))
        there = np.abs(model.htf(self.operator.harmonics, self.estimate.htf.frequency[some]))
        difference = self.weight[:, some] * (there - self.measured[:, some])
        return float(np.sqrt(np.mean(difference**2)) / self.size)

    def misfit(self, residual: Array) -> float:
        """rms of the magnitudes' differences relative to the magnitudes."""
        return float(np.sqrt(np.mean(residual[:-1] ** 2)) / self.size)


def _descend(comparison: _Comparison, start: Array) -> tuple[Array, Array]:
    bounds = [comparison.model.parameters[name].bounds for name in comparison.names]
    low, high = np.array([b[0] for b in bounds]), np.array([b[1] for b in bounds])
    inside = np.clip(start, low, high)
    found = least_squares(
        comparison.residual, inside, comparison.jacobian,  # pyright: ignore[reportArgumentType] — its stub knows only names
        bounds=(low, high), x_scale="jac", xtol=1e-7, ftol=1e-9, gtol=1e-12, max_nfev=40,
    )  # fmt: skip
    return found.x, found.fun


def _scan(cost: Callable[[Array], float], start: Array) -> Array:
    """Best point of a multiplicative grid, one parameter after the other, in two passes over the sensitive parameters."""
    values, best = start.copy(), cost(start)
    order = list(range(len(values)))
    for _ in range(2):
        for i in tuple(order):
            costs = []
            for factor in SCAN:
                trial = values.copy()
                trial[i] = start[i] * factor
                costs.append(cost(trial))
                if costs[-1] < best:
                    best, values = costs[-1], trial
            if max(costs) < min(costs) + 1e-3 * best:
                order.remove(i)
    return values


def fit_magnitude(estimate: HtfEstimate, model: Model) -> MagnitudeFit:
    """Fit the model's free parameters to |Ĝ_m|, equation (8), and to the mean of the limit cycle.

    Where the model's own values are far off, starts between 0.4 and 2.5 times them are tried. Raises InputError when the
    model has no limit cycle at its own values.
    """
    names = undelayed_parameters(model)
    comparison = _Comparison(estimate, model, names)
    start = np.array([model.value(name) for name in names])
    comparison.linearised(start)  # raises the reason when even these values do not work
    if comparison.rough(start) > POOR_MAGNITUDE:
        start = _scan(comparison.rough, start)
    values, residual = _descend(comparison, start) if names else (start, comparison.residual(start))
    fitted = model.with_values(dict(zip(names, values)))
    final = comparison.linearised(values)
    covariance = _covariance(comparison, values, residual) if names else np.empty((0, 0))
    return MagnitudeFit(
        fitted,
        tuple(names),
        values,
        covariance,
        final,
        comparison.expected(final),
        comparison.misfit(residual),
    )


def _covariance(comparison: _Comparison, values: Array, residual: Array) -> Array:
    """Covariance (p, p) from the scatter of the residual; the smoothing correlates the noise of neighbouring bins."""
    jacobian = comparison.jacobian(values)
    norms = np.linalg.norm(jacobian, axis=0)
    dead = norms <= 1e-12 * norms.max(initial=0.0)
    norms[dead] = 1.0
    operator = comparison.operator
    together = max(1.0, 1.0 / (HAT * operator.window * operator.spectra.resolution))
    independent = max(1.0, float(np.sum(comparison.weight > 0.0)) / together - len(values))
    scatter = float(np.sum(residual[:-1] ** 2)) / independent
    _, singular, right = np.linalg.svd(jacobian / norms, full_matrices=False)
    determined = singular > 1e-5 * singular[0]
    inverse = (right.T[:, determined] / singular[determined]) @ (
        right.T[:, determined] / singular[determined]
    ).T
    covariance = scatter * inverse / np.outer(norms, norms)
    unknown = dead | (np.abs(right[~determined]).max(axis=0, initial=0.0) > 1e-3)
    covariance[unknown, unknown] = np.inf
    return covariance
