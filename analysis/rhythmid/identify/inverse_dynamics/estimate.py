"""Inverse-dynamics identification: parameters from the effort balance, by Gauss-Newton with Student's t errors and
priors.

The linear estimator is that of M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362. Elements that are not
linear in a parameter are linearised again at every step. One nuisance parameter is added: the alignment of effort
and motion in time, which is known to a sample.
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
# latest fits that a balance keeps: more than the hypotheses of a joint (measured: 261 fits in all for the four joints of an arm)
REMEMBERED = 64
# relative standard deviation of a value without a stated prior: a factor of two either way (ln 2)
SPREAD = 0.7
# least change of the effort, as a share of its size, that one standard deviation of a prior allows: a placeholder
# in the file excludes nothing
FAINTEST = 0.1
# samples: standard deviation of the alignment of effort and motion, whose timestamps a driver rounds to a sample
ALIGNED = 1.0
FARTHEST = 2.0  # samples: largest misalignment; a longer delay is a separate hypothesis
# share of a sample that timestamp jitter and interpolation add to the standard deviation of a delay
# (measured: delays of joints on one bus scatter by 0.01 to 0.02 of a sample; their standard deviations from noise
# alone are smaller)
ROUGH = 0.03
LEAST_INERTIA = 0.01  # least value of an inertia or motor constant, relative to its start: none vanishes
# largest factor by which one of these becomes smaller in a step: quotients by it are strongly nonlinear
SHRINKS = 3.0
STEPS = 12  # most Gauss-Newton steps
HALVINGS = 5
SETTLED = 1e-4  # relative change of the cost below which the fit has converged
DIFFERENCE = 1e-4  # step of the finite difference, relative to a parameter's size
# prior standard deviation, relative to the value, of a parameter that does not change the effort
FAR_SPREADS = 1e3


@dataclass(frozen=True)
class Alignment:
    """Prior of the alignment [s]: normal about `mean`, at most `most` from 0."""

    std: float
    low: float
    high: float
    mean: float = 0.0

    @classmethod
    def of(cls, balance: Balance) -> "Alignment":
        """One sample of motion or effort, whichever is longer, as standard deviation unless more is known, and two as limit."""
        std = ALIGNED * balance.period if balance.aligned is None else balance.aligned
        return cls(std, -FARTHEST * balance.period, FARTHEST * balance.period)


@dataclass(frozen=True, eq=False)
class EffortFit:
    """A model fitted to recorded efforts, with n rows and p parameters: the alignment [s], then `names`.

    `residual` (n,) is predicted minus measured effort, `jacobian` (n, p) its derivatives. `precision` (p,) holds
    the priors' inverse variances, `departure` (p,) the distances of the values from the prior means. `std` (p,)
    follows from the weighted normal equations, inflated by the residual's autocorrelation time `correlation`
    [rows]. `at_limit` (p,) marks parameters at a bound.
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
    """Size (rms) of the recorded effort at the rows; of a constant effort its value. Where no motor acts, it is the size of what the rest of
    the body requires along the joint."""
    return _size(balance.measured) or _of_coupling(balance) or 1.0


def _size(effort: Array) -> float:
    return float(np.sqrt(np.mean(effort**2)))


def _of_coupling(balance: Balance) -> float:
    coupled = [one.coupling for one in balance.motions if one.coupling is not None]
    return _size(balance.rows(coupled)) if len(coupled) == len(balance.motions) else 0.0


def variation_of(balance: Balance) -> float:
    """Reference for relative errors: the rms of the recorded effort about its mean, because a constant holding force
    says nothing about a motion.

    Where the motion has one direction only, the mean may as well be friction, and is kept: only that component of a
    constant is removed which is orthogonal to the direction of motion. For a constant effort it is the effort's size.
    """
    effort, direction = balance.measured, np.sign(balance.mechanical[:, 1])
    constant = 1.0 - np.mean(direction) * direction
    power = float(constant @ constant)
    if power > 0.0:
        effort = effort - constant * (float(constant @ effort) / power)
    return float(np.sqrt(np.mean(effort**2))) or size_of(balance)


def priors_of(balance: Balance, model: Model, names: Sequence[str], columns: Array) -> dict[str, Prior]:
    """Priors of parameters; `columns` (n, p) are their effects per unit.

    The file's prior is used where it states one. Otherwise a positive parameter is known to a factor of two, and
    any other parameter changes the effort by at most about the effort's own size: no friction exceeds the force
    that moves the machine.
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
    signals = balance.all_filtered(signals)
    rows = balance.at_rows(signals, balance.later(model, alignment))
    first, late = [signal[:, 0] for signal in signals], 0.25 * balance.period
    after, before = (
        balance.with_moved(balance.at_rows(first, balance.later(model, at)), model, at)
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
    """Fit the named free parameters of a model (by default all that the effort depends on) to the recorded efforts.

    `priors` add to `priors_of`. The fit starts from the model's values and from `alignment` [s]. If a deadline
    passes, it returns the values reached so far. A fit of which all is as in one of the latest fits is that fit.
    """
    names = tuple(balance.estimated(model) if names is None else names)
    aligned = aligned or Alignment.of(balance)
    of = tuple((term.label, id(term.element), tuple(term.values.items())) for term in model.terms)
    key = (model.mass, of, names, tuple((priors or {}).items()), aligned, alignment, steps)
    if (known := balance.fits.get(key)) is not None:
        return known[0]
    made = _fitted(balance, model, names, priors or {}, aligned, alignment, steps)
    if not time_is_up():
        if len(balance.fits) >= REMEMBERED:
            del balance.fits[next(iter(balance.fits))]
        balance.fits[key] = made, model  # the model keeps the elements of the key
    return made


def _fitted(
    balance: Balance, model: Model, names: tuple[str, ...], priors: Mapping[str, Prior], aligned: Alignment,
    alignment: float, steps: int,
) -> EffortFit:  # fmt: skip
    """The fit of `fit_effort`."""
    alignment = min(max(alignment, aligned.low), aligned.high)
    residual, jacobian = linearise(balance, model, names, alignment)
    known = {**priors_of(balance, model, names, jacobian[:, 1:]), **priors}
    mean: Array = np.array([aligned.mean, *(known[name].mean for name in names)])
    precision: Array = np.array([aligned.std**-2, *(known[name].std ** -2 for name in names)])
    bounds = [(aligned.low, aligned.high), *(model.parameters[name].bounds for name in names)]
    low: Array = np.array([least for least, _ in bounds])
    high: Array = np.array([most for _, most in bounds])
    divides: NDArray[np.bool_] = np.array([False, *(_divides(model, name) for name in names)])
    low[divides] = np.maximum(low, LEAST_INERTIA * mean)[divides]
    value: Array = np.array([alignment, *(model.value(name) for name in names)])

    def cost(error: Array, at: Array, scale: float) -> float:
        return cost_of(error, scale) + 0.5 * float(precision @ (at - mean) ** 2)

    for _ in range(steps):
        if time_is_up():
            break
        scale = scale_of(residual)
        before = cost(residual, value, scale)
        nearest: Array = np.where(divides, np.maximum(low, value / SHRINKS), low)
        step = _step(residual, jacobian, precision, value, mean, nearest, high, scale)
        share, improved = 1.0, False
        for _ in range(HALVINGS):
            trial: Array = np.clip(value + share * step, low, high)
            moved = model.with_values(dict(zip(names, trial[1:].tolist(), strict=True)))
            error: Array = balance.predicted(moved, float(trial[0])) - balance.measured
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
    """Whether a parameter cannot be 0: the inertia, or a motor constant (the gain from signal to force, or its limit)."""
    term = model.term(name.split(".")[0])
    return name == INERTIA or (term is not None and term.element.acts == "transducer")  # pyright: ignore[reportUnnecessaryComparison]


def _step(
    residual: Array, jacobian: Array, precision: Array, value: Array, mean: Array, low: Array, high: Array,
    scale: float,
) -> Array:  # fmt: skip
    """Gauss-Newton step (p,). A component that would leave its bounds is fixed there, and the others are solved again."""
    weight = weights_of(residual, scale) / scale**2
    normal = (jacobian * weight[:, None]).T @ jacobian + np.diag(precision)
    slope = jacobian.T @ (weight * residual) + precision * (value - mean)
    step: Array = np.zeros(len(value))
    free: NDArray[np.bool_] = np.ones(len(value), bool)
    for _ in range(len(value)):
        if not free.any():
            break
        part = normal[np.ix_(free, free)]
        scaling = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-300))
        rest = slope[free] + normal[np.ix_(free, ~free)] @ step[~free]
        step[free] = (
            -scaling * np.linalg.lstsq(part * np.outer(scaling, scaling), scaling * rest, rcond=1e-12)[0]
        )
        outside: NDArray[np.bool_] = free & ((value + step < low) | (value + step > high))
        if not outside.any():
            break
        step[outside] = np.clip(value[outside] + step[outside], low[outside], high[outside]) - value[outside]
        free &= ~outside
    return step


def condition_of(fit: EffortFit) -> float:
    """Condition number of the parameters' columns, each scaled to length 1, without the priors.

    A parameter without effect on any row, such as the time of a jump within a sample, is collinear with no other
    and is left out.
    """
    columns = fit.jacobian[:, 1:]
    norms = np.linalg.norm(columns, axis=0)
    acting = norms > 0.0
    if not acting.any():
        return math.inf if len(norms) else 1.0
    values = np.linalg.svd(columns[:, acting] / norms[acting], compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0.0 else math.inf
