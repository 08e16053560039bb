"""Inverse-dynamics identification: parameters from the balance of effort, by Gauss-Newton with Student's t errors and priors.

M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362 (the linear estimator); elements that are not linear in a parameter
are linearised again at every step. One nuisance stands beside the parameters: the alignment of effort and motion in time, known
to a sample.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import time_is_up
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.student import autocorrelation_time, cost_of, scale_of, weights_of
from rhythmid.model import INERTIA, Model
from rhythmid.value import Prior

Array = NDArray[np.float64]
SPREAD = 0.7  # relative standard deviation of a value that the file states without a prior: a factor of two either way (ln 2)
FAINTEST = 0.1  # of the effort that one standard deviation of a prior may move at least: a file's placeholder forbids nothing
ALIGNED = 1.0  # samples: standard deviation of the alignment of effort and motion, whose stamps a driver rounds to a sample
FARTHEST = 2.0  # samples by which they may be out; a longer delay is a hypothesis of its own
LEAST_INERTIA = 0.01  # of an inertia or a motor's constant that is thought of, at least: none vanishes
SHRINKS = 3.0  # times by which one of these becomes smaller in a step, at most: what is divided by it is far from linear
STEPS = 12  # Gauss-Newton steps at most
HALVINGS = 5
SETTLED = 1e-4  # change of the cost below which it is at its end
DIFFERENCE = 1e-4  # of a parameter's size: step of its finite difference
FAR_SPREADS = 1e3  # spreads of the effort's size: a column that moves the effort by less for one unit has no size of its own


@dataclass(frozen=True)
class Alignment:
    """What is known of the alignment [s] before the data: normal about `mean`, at most `most` from 0."""

    std: float
    low: float
    high: float
    mean: float = 0.0

    @classmethod
    def of(cls, balance: Balance) -> "Alignment":
        """A sample wide, two at most."""
        return cls(ALIGNED * balance.period, -FARTHEST * balance.period, FARTHEST * balance.period)


@dataclass(frozen=True, eq=False)
class EffortFit:
    """A model fitted to recorded efforts; n rows, p parameters: the alignment [s], then `names`.

    `residual` (n,) is predicted less measured, `jacobian` (n, p) its derivatives, `precision` (p,) and `departure` (p,) the
    priors' inverse variances and how far the values are from their means. `std` (p,) follows from the weighted normal
    equations, inflated by the residual's autocorrelation time [rows] `correlation`. `at_limit` (p,) marks what ends at a bound.
    """

    model: Model
    names: tuple[str, ...]
    alignment: float
    residual: Array
    jacobian: Array
    precision: Array
    departure: Array
    scale: float
    cost: float
    std: Array
    correlation: float
    at_limit: NDArray[np.bool_]

    @property
    def error(self) -> float:
        """rms of the residual, in the effort's unit."""
        return float(np.sqrt(np.mean(self.residual**2)))


def size_of(balance: Balance) -> float:
    """Size (rms) of the recorded effort at the rows; of a constant effort it is that constant."""
    return float(np.sqrt(np.mean(balance.measured**2))) or 1.0


def variation_of(balance: Balance) -> float:
    """What errors are a share of: the rms of the recorded effort about its mean, for a model explains no motion by the force that a machine
    needs at rest; of a constant effort its size."""
    return float(np.std(balance.measured)) or size_of(balance)


def priors_of(balance: Balance, model: Model, names: Sequence[str], columns: Array) -> dict[str, Prior]:
    """What is known of parameters before the data; `columns` (n, p) are their effects for each unit.

    The file's prior where it states one. Else a value that has to be positive is right to a factor of two, and any other one
    changes the effort by as much as the effort is: no friction is greater than what moves the machine.
    """
    size, found = size_of(balance), {}
    parameters = model.parameters
    for name, column in zip(names, columns.T, strict=True):
        value = parameters[name]
        if value.prior is not None:
            found[name] = value.prior
            continue
        strength = float(np.sqrt(np.mean(column**2)))
        widest = size / strength if strength > 0.0 else FAR_SPREADS * max(abs(value.value), 1.0)
        std = widest
        if value.bounds[0] >= 0.0 and value.value > 0.0:
            std = max(SPREAD * value.value, min(FAINTEST * widest, widest))
        found[name] = Prior(value.value, std)
    return found


def linearise(balance: Balance, model: Model, names: Sequence[str], alignment: float) -> tuple[Array, Array]:
    """Residual (n,), and its derivatives (n, 1 + p) with respect to the alignment and the named parameters."""
    parameters = model.parameters
    steps = {}
    for name in names:
        value = parameters[name]
        step = DIFFERENCE * (abs(value.value) or 1.0)
        steps[name] = -step if value.value + step > value.bounds[1] else step
    required, moved = balance.sensitive(model, steps)
    signals = [
        np.column_stack([old, *(column[index] for column in moved)]) for index, old in enumerate(required)
    ]
    rows = balance.rows(signals, balance.later(model, alignment))
    first, late = [signal[:, 0] for signal in signals], 0.25 * balance.period
    after, before = (
        balance.with_moved(balance.rows(first, balance.later(model, at)), model, at)
        for at in (alignment + late, alignment - late)
    )
    residual = balance.with_moved(rows[:, 0], model, alignment) - balance.measured
    return residual, np.column_stack([(after - before) / (2.0 * late), rows[:, 1:]])


def fit_effort(
    balance: Balance,
    model: Model,
    names: Sequence[str] | None = None,
    priors: Mapping[str, Prior] | None = None,
    aligned: Alignment | None = None,
    alignment: float = 0.0,
    steps: int = STEPS,
) -> EffortFit:
    """Fit the named free parameters of a model (all that the effort can tell of) to the recorded efforts.

    `priors` state more than `priors_of` knows. Starts from the model's values and from `alignment` [s]. It ends with what it has where
    a deadline passes.
    """
    names = tuple(balance.estimated(model) if names is None else names)
    aligned = aligned or Alignment.of(balance)
    alignment = min(max(alignment, aligned.low), aligned.high)
    residual, jacobian = linearise(balance, model, names, alignment)
    known = {**priors_of(balance, model, names, jacobian[:, 1:]), **(priors or {})}
    mean = np.array([aligned.mean, *(known[name].mean for name in names)])
    precision = np.array([aligned.std**-2, *(known[name].std ** -2 for name in names)])
    bounds = [(aligned.low, aligned.high), *(model.parameters[name].bounds for name in names)]
    for place, name in enumerate(names, start=1):
        if _divides(model, name):
            bounds[place] = (max(bounds[place][0], LEAST_INERTIA * known[name].mean), bounds[place][1])
    low, high = (np.array(side) for side in zip(*bounds, strict=True))
    value = np.array([alignment, *(model.value(name) for name in names)])

    divides = np.array([False, *(_divides(model, name) for name in names)])

    def cost(error: Array, at: Array, scale: float) -> float:
        return cost_of(error, scale) + 0.5 * float(precision @ (at - mean) ** 2)

    for _ in range(steps):
        if time_is_up():
            break
        scale = scale_of(residual)
        before = cost(residual, value, scale)
        nearest = np.where(divides, np.maximum(low, value / SHRINKS), low)
        step = _step(residual, jacobian, precision, value, mean, nearest, high, scale)
        share, improved = 1.0, False
        for _ in range(HALVINGS):
            trial = np.clip(value + share * step, low, high)
            moved = model.with_values(dict(zip(names, trial[1:].tolist(), strict=True)))
            error = balance.predicted(moved, float(trial[0])) - balance.measured
            if np.isfinite(error).all() and cost(error, trial, scale) < before:
                improved = True
                break
            share *= 0.5
        if not improved:
            break
        model, value = moved, trial
        gained = before - cost(error, value, scale)
        residual, jacobian = linearise(balance, model, names, float(value[0]))
        if gained < SETTLED * len(residual):
            break
    scale = scale_of(residual)
    time = autocorrelation_time(residual, balance.record)
    weight = weights_of(residual, scale) / scale**2
    normal = (jacobian * weight[:, None]).T @ jacobian / time + np.diag(precision)
    scaling = 1.0 / np.sqrt(np.diag(normal))
    covariance = np.linalg.pinv(normal * np.outer(scaling, scaling)) * np.outer(scaling, scaling)
    return EffortFit(
        model, names, float(value[0]), residual, jacobian, precision, value - mean, scale,
        cost(residual, value, scale), np.sqrt(np.maximum(np.diag(covariance), 0.0)), time,
        (value <= low) | (value >= high),
    )  # fmt: skip


def _divides(model: Model, name: str) -> bool:
    """Whether a parameter is one that cannot be 0: the inertia, or a constant of the motor: what turns a signal into a force, and what limits that."""
    term = model.term(name.split(".")[0])
    return name == INERTIA or (term is not None and term.element.acts == "transducer")  # pyright: ignore[reportUnnecessaryComparison]


def _step(
    residual: Array, jacobian: Array, precision: Array, value: Array, mean: Array, low: Array, high: Array,
    scale: float,
) -> Array:  # fmt: skip
    """Gauss-Newton step (p,); what would leave its bounds stays on them and the others are solved for again."""
    weight = weights_of(residual, scale) / scale**2
    normal = (jacobian * weight[:, None]).T @ jacobian + np.diag(precision)
    slope = jacobian.T @ (weight * residual) + precision * (value - mean)
    step, free = np.zeros(len(value)), np.ones(len(value), bool)
    for _ in range(len(value)):
        if not free.any():
            break
        part = normal[np.ix_(free, free)]
        scaling = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-300))
        rest = slope[free] + normal[np.ix_(free, ~free)] @ step[~free]
        step[free] = (
            -scaling * np.linalg.lstsq(part * np.outer(scaling, scaling), scaling * rest, rcond=1e-12)[0]
        )
        outside = free & ((value + step < low) | (value + step > high))
        if not outside.any():
            break
        step[outside] = np.clip(value[outside] + step[outside], low[outside], high[outside]) - value[outside]
        free &= ~outside
    return step


def condition_of(fit: EffortFit) -> float:
    """Condition number of the parameters' columns, each scaled to length 1, without the priors' help.

    A parameter that moves no row, such as the time of a jump within a sample, is mistaken for no other one and does not count.
    """
    columns = fit.jacobian[:, 1:]
    norms = np.linalg.norm(columns, axis=0)
    acting = norms > 0.0
    if not acting.any():
        return math.inf if len(norms) else 1.0
    values = np.linalg.svd(columns[:, acting] / norms[acting], compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0.0 else math.inf
