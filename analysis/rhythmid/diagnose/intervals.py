"""Do the intervals of the named effects hold? The likelihood is followed to their ends, and beyond where it asks for it.

A covariance knows the likelihood's curvature at one point. An effect with a corner (a stop that is touched for a moment, a play
whose far edge is never reached) can be curved there and flat or falling further on. So every parameter of an effect is
moved to both ends of its 95 % interval and far beyond, the others along with it as their covariance says: chi2 has to rise by the
square of the way in standard deviations. Where it does not, the others are fitted again for the moved parameter. If chi2
then falls, the descent goes on from there; if it hardly rises, the interval is widened until it does, or is open, and
those of all that was fitted again with it. A plain beside a narrow notch outweighs the notch by its width, so that chi2 has to
rise the more the further away it is.
(Profile likelihood: S. A. Murphy, A. W. van der Vaart, J. Am. Stat. Assoc. 95 (2000) 449.)
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import time_is_up
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.refit import whole_fit
from rhythmid.errors import InputError
from rhythmid.identify.descent import descend
from rhythmid.identify.output_error import Fit
from rhythmid.identify.sensitivity import Problem
from rhythmid.model import Model

Array = NDArray[np.float64]
END = 2.0  # standard deviations at which chi2 should have risen by their square
FURTHER_DEVIATIONS = 8.0, 32.0  # further ones at which it is looked whether it has
ODD = 2.0  # times more or less than that rise, from which on the others are fitted again;
ODD_FURTHER = 8.0  # times less further on, where few likelihoods are parabolas
FLAT = 0.25  # of that rise with the others fitted, below which an interval is too narrow
FALLS = 2.0  # by how much chi2 has to be lower elsewhere to go there
WIDEST = 2.0**20  # standard deviations up to which the rise is sought,
BEYOND = 30.0  # but no further than this times the parameter's value
DESCENTS = 3  # to lower minima, at most
TIED = 0.5  # share of its variance that a parameter of the machine has in common with one of an effect, to be tried, too
AGAIN = 6  # iterations of the other parameters for a moved one


@dataclass(frozen=True)
class _Way:
    """From a fit along one of its parameters, to this many standard deviations (negative: downwards) or beyond."""

    place: int
    deviations: float

    def further(self, factor: float) -> "_Way":
        return replace(self, deviations=factor * self.deviations)


def profiled(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """The search with its fit at the lowest minimum within sight, and intervals of its effects that the likelihood bears out.

    A parameter whose likelihood does not rise before its bound, or before it has lost all relation to its value, is
    undetermined: its variance is infinite. Where a deadline passes the intervals are borne out as far as they were followed.
    """
    reach = np.zeros(len(found.fit.names))
    for _ in range(DESCENTS):
        if time_is_up():
            break
        reach, lower = _reach(found.fit, _places(found), pool)
        better = None if lower is None else _descended(found, lower, pool)
        if better is None:
            break
        found = better
    return replace(found, fit=widened(found.fit, reach))


def _places(found: Search) -> list[int]:
    """Where the named effects' determined parameters stand among the fit's, and those of the machine that move with them."""
    fit = found.fit
    std = np.array([fit.std[name] for name in fit.names])
    known = (std > 0.0) & np.isfinite(std)
    own = known & np.array([name.rpartition(".")[0] in found.best.added for name in fit.names])
    with np.errstate(invalid="ignore", divide="ignore"):
        alike = (fit.covariance / np.outer(std, std)) ** 2
    return [int(i) for i in np.flatnonzero(known) if own[i] or np.any(alike[i, own] > TIED)]


def _reach(fit: Fit, places: Sequence[int], pool: ThreadPoolExecutor | None) -> tuple[Array, Model | None]:
    """How far from the fit each parameter (p,) is still likely, as far as the covariance does not say so: infinite where it
    is undetermined, 0 without such a finding. And the model where chi2 falls, if there is one."""
    ways = [
        [_Way(place, sign * deviations) for deviations in (END, *FURTHER_DEVIATIONS)]
        for place in places
        for sign in (-1.0, 1.0)
    ]
    rises = iter(_rises(fit, [way for along in ways for way in along], pool))
    reach = np.zeros(len(fit.names))
    for along in ways:
        for way, rise in [(way, next(rises)) for way in along]:
            if not _odd(way, rise) or time_is_up():
                continue
            likely, lower = _followed(fit, way, pool)
            if lower is not None:
                return reach, lower
            if likely is not None:
                reach = np.maximum(reach, likely)
                break
    return reach, None


def _odd(way: _Way, rise: float) -> bool:
    """Whether chi2 rises otherwise than a parabola along a way."""
    due = way.deviations**2
    if abs(way.deviations) > END:
        return rise < due / ODD_FURTHER
    return rise < due / ODD or ODD * due < rise < math.inf


def _enough(way: _Way) -> float:
    """Rise of chi2 at the end of a way, beyond which a parameter is not likely to be."""
    far = abs(way.deviations) / END
    return END**2 + 2.0 * math.log(far) if far > 1.0 else FLAT * END**2


def _followed(fit: Fit, way: _Way, pool: ThreadPoolExecutor | None) -> tuple[Array | None, Model | None]:
    """How far all parameters (p,) get along a way until chi2 rises as it should, None where it does at once; or the model
    where it falls."""
    rise, model = _again(fit, way, pool)
    if rise >= _enough(way):
        return None, None
    reach = np.zeros(len(fit.names))
    while rise < _enough(way) and not time_is_up():
        if rise < -FALLS:
            return None, model
        reach = np.maximum(reach, _distance(fit, model))
        way = way.further(2.0)
        if not _within(fit, way):
            reach[way.place] = math.inf
            return reach, None
        rise, model = _again(fit, way, pool)
    before = way.further(0.75)
    rise, model = _again(fit, before, pool)
    if rise < _enough(before):
        reach = np.maximum(reach, _distance(fit, model))
    reach[way.place] = abs(way.deviations) * math.sqrt(fit.covariance[way.place, way.place])
    return reach, None


def _distance(fit: Fit, model: Model) -> Array:
    return np.abs([model.value(name) - value for name, value in zip(fit.names, fit.values)])


def _moved(fit: Fit, way: _Way) -> Model | None:
    """The model with one parameter moved, and with it the others; None where a bound is in the way."""
    column = fit.covariance[:, way.place]
    values = fit.values + way.deviations * column / math.sqrt(column[way.place])
    bounds = [fit.model.parameters[name].bounds for name in fit.names]
    if not bounds[way.place][0] < values[way.place] < bounds[way.place][1]:
        return None
    clipped = [float(np.clip(value, *bound)) for value, bound in zip(values, bounds)]
    return fit.model.with_values(dict(zip(fit.names, clipped)))


def _rises(fit: Fit, ways: Sequence[_Way], pool: ThreadPoolExecutor | None) -> list[float]:
    """By how much chi2 rises along each way, less what small changes of initial states and other parameters can do about
    it; infinite beyond a bound and where the model diverges."""
    models = [_moved(fit, way) for way in ways]
    outputs = iter(fit.run.many([(model, fit.starts) for model in models if model is not None], pool))
    problem = Problem(fit.run, fit.names, fit.noise, pool)
    rises = []
    for way, model in zip(ways, models):
        given = None if model is None else next(outputs)
        left = None if given is None else [o - one.averaged for o, one in zip(given, fit.run.series)]
        rises.append(math.inf if left is None else _rise(problem, fit, way.place, left))
    return rises


def _rise(problem: Problem, fit: Fit, place: int, residuals: Sequence[Array]) -> float:
    columns = np.delete(fit.linearisation.jacobian, place, axis=1)
    norms = np.linalg.norm(columns, axis=0)
    others, _ = np.linalg.qr(columns / np.where(norms > 0.0, norms, 1.0))

    def left(given: Sequence[Array]) -> float:
        white = [problem.whitened(index, residual) for index, residual in enumerate(given)]
        rest = np.concatenate([w - b @ (b.T @ w) for w, b in zip(white, fit.linearisation.bases)])
        return float(np.sum((rest - others @ (others.T @ rest)) ** 2))

    with np.errstate(over="ignore", invalid="ignore"):
        rise = left(residuals) - left(fit.residuals)
    return rise if math.isfinite(rise) else math.inf


def _within(fit: Fit, way: _Way) -> bool:
    """Whether a way ends before its parameter's bound, and nearer than where it has lost all relation to its value."""
    far = abs(way.deviations) * math.sqrt(fit.covariance[way.place, way.place])
    near = far < BEYOND * abs(fit.values[way.place]) and abs(way.deviations) <= WIDEST
    return near and _moved(fit, way) is not None


def _again(fit: Fit, way: _Way, pool: ThreadPoolExecutor | None) -> tuple[float, Model]:
    """By how much chi2 rises along a way with the other parameters fitted again, and the model there."""
    model = _moved(fit, way)
    if model is None:
        return math.inf, fit.model
    others = [name for place, name in enumerate(fit.names) if place != way.place]
    steps, state_steps = fit.differences
    try:
        end = descend(
            model, fit.run, others, fit.noise, fit.starts, AGAIN, pool,
            differences=(np.delete(steps, way.place), state_steps),
        )  # fmt: skip
    except InputError:
        return math.inf, fit.model
    return end.chi2 - fit.chi2, end.model


def _descended(found: Search, model: Model, pool: ThreadPoolExecutor | None) -> Search | None:
    """The search with its fit descended anew from a model; None where that ends no lower."""
    fit = found.fit
    trial = replace(found.best, model=model, starts=fit.starts, converged=False, differences=None)
    try:
        again = whole_fit(trial, fit.run.series, found.noise, fit.run.max_step, pool=pool)
    except InputError:
        return None
    if again.chi2 > fit.chi2 - FALLS:
        return None
    return settled_at(found, again)


def settled_at(found: Search, fit: Fit) -> Search:
    """The search with another fit of its chosen model."""
    best = replace(found.best, model=fit.model, starts=fit.starts, chi2=fit.chi2, converged=fit.converged)
    trials = tuple(best if trial is found.best else trial for trial in found.trials)
    return replace(found, fit=fit, best=best, trials=trials)


def widened(fit: Fit, reach: Array) -> Fit:
    """The fit with 95 % intervals of at least this half-width (p,); an undetermined parameter leaves the others alone."""
    std = np.sqrt(np.diag(fit.covariance))
    factors = np.ones(len(std))
    known = (std > 0.0) & np.isfinite(std)
    factors[known] = np.maximum(1.0, reach[known] / (END * std[known]))
    open_ones = np.isinf(factors)
    factors[open_ones] = 0.0
    covariance = fit.covariance * np.outer(factors, factors)
    covariance[open_ones, open_ones] = math.inf
    return replace(fit, covariance=covariance)
