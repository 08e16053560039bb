"""Refine the fit of the chosen model, and check and widen the confidence intervals of the named effects by following the likelihood.

A covariance describes the likelihood's curvature at one point. For an effect with a corner (a stop touched for a moment, a
play whose far edge is never reached) the likelihood can be curved at that point and flat or lower further on. Every parameter
of an effect is therefore moved to both ends of its 95 % interval and far beyond. The other parameters follow as their covariance
predicts. Chi2 has to rise by the square of the distance in standard deviations. Where it does not, the other parameters are
refitted at the moved parameter. If chi2 then falls, the descent continues from there. If it hardly rises, the interval is widened
until it does, or is infinite; the intervals of all refitted parameters are widened with it. A flat region beside a narrow
minimum outweighs the minimum by its width; so the required rise of chi2 grows with the distance.
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
from rhythmid.identify.covariance import covariance_of
from rhythmid.identify.descent import descend
from rhythmid.identify.free_run import halved, sufficient
from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.output_error import INTEGRATION, Fit, minimise
from rhythmid.identify.sample_clock.clock import clock_of
from rhythmid.identify.sample_clock.tick_likelihood import moved_to, places_of, tried, white_residual
from rhythmid.identify.sensitivity import Problem
from rhythmid.model import Model

Array = NDArray[np.float64]
END = 2.0  # standard deviations at which chi2 must have risen by their square
FURTHER_DEVIATIONS = 8.0, 32.0  # further distances at which the rise is checked [standard deviations]
ODD = 2.0  # factor by which the rise may differ from the expected one before the others are refitted
ODD_FURTHER = 8.0  # the same at the further distances, below the expected rise only: few likelihoods are parabolas there
FLAT = 0.25  # share of the expected rise, after refitting the others, below which an interval is too narrow
FALLS = 2.0  # fall of chi2 from which the descent continues at the other point
WIDEST = 2.0**20  # largest distance at which the rise is sought [standard deviations]
BEYOND = 30.0  # the same as a multiple of the parameter's value
DESCENTS = 3  # largest number of descents to lower minima
TIED = 0.5  # share of its variance that a machine parameter must have in common with an effect's parameter to be checked, too
ITERATIONS = 6  # iterations of the other parameters at a moved one
HALVINGS = 2  # halvings of the step for estimates: for smooth forces the error falls to a 256th
LIKELY = 6.0  # excess of chi2 that covers 95 % of two parameters, here period and delay of a clock together


@dataclass(frozen=True)
class _Way:
    """A step from the fit along one parameter [standard deviations]; negative means downwards."""

    place: int
    deviations: float

    def further(self, factor: float) -> "_Way":
        return replace(self, deviations=factor * self.deviations)


def profiled(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """The search with its fit at the lowest minimum found, and effect intervals that the likelihood confirms.

    A parameter is undetermined, with infinite variance, if the likelihood rises neither before its bound nor within a
    meaningful multiple of its value (of a phase: half a turn). If a deadline passes, the intervals are confirmed only as
    far as they were followed.
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
    """Indices of the effects' determined parameters among the fit's, and of machine parameters correlated with them."""
    fit = found.fit
    std = np.array([fit.std[name] for name in fit.names])
    known = (std > 0.0) & np.isfinite(std)
    own = known & np.array([name.rpartition(".")[0] in found.best.added for name in fit.names])
    with np.errstate(invalid="ignore", divide="ignore"):
        alike = (fit.covariance / np.outer(std, std)) ** 2
    return [int(i) for i in np.flatnonzero(known) if own[i] or np.any(alike[i, own] > TIED)]


def _reach(fit: Fit, places: Sequence[int], pool: ThreadPoolExecutor | None) -> tuple[Array, Model | None]:
    """Distance (p,) up to which each parameter is likely beyond what the covariance says, and a model with lower chi2, if any.

    The distance is infinite for an undetermined parameter, and 0 where the covariance is sufficient.
    """
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
    """Whether the rise of chi2 along a step differs from that of a parabola."""
    due = way.deviations**2
    if abs(way.deviations) > END:
        return rise < due / ODD_FURTHER
    return rise < due / ODD or ODD * due < rise < math.inf


def _enough(way: _Way) -> float:
    """Rise of chi2 at the end of a step from which the parameter's value is unlikely."""
    far = abs(way.deviations) / END
    return END**2 + 2.0 * math.log(far) if far > 1.0 else FLAT * END**2


def _followed(fit: Fit, way: _Way, pool: ThreadPoolExecutor | None) -> tuple[Array | None, Model | None]:
    """Follow a step until chi2 has risen enough.

    Returns the distance (p,) of all parameters there, None where the first step suffices; or the model where chi2 falls.
    """
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
    """Distance (p,) of a model's parameters from those of the fit, of a phase the nearest way round."""
    turns = fit.model.turns
    away = [
        math.remainder(model.value(name) - value, turns.get(name, math.inf))
        for name, value in zip(fit.names, fit.values)
    ]
    return np.abs(away)


def _moved(fit: Fit, way: _Way) -> Model | None:
    """The model with one parameter moved and the others following the covariance.

    None where a bound is in the way, and for a phase beyond half a turn, from where it comes back to the same model.
    """
    column = fit.covariance[:, way.place]
    if abs(way.deviations) * math.sqrt(column[way.place]) > _half_turn(fit, way.place):
        return None
    values = fit.values + way.deviations * column / math.sqrt(column[way.place])
    bounds = [fit.model.parameters[name].bounds for name in fit.names]
    if not bounds[way.place][0] < values[way.place] < bounds[way.place][1]:
        return None
    clipped = [float(np.clip(value, *bound)) for value, bound in zip(values, bounds)]
    return fit.model.with_values(dict(zip(fit.names, clipped)))


def _rises(fit: Fit, ways: Sequence[_Way], pool: ThreadPoolExecutor | None) -> list[float]:
    """Rise of chi2 along each step, to first order after refitting the initial states and the other parameters.

    Infinite beyond a bound and where the model diverges.
    """
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
    others, _ = np.linalg.qr(columns / column_norms(columns))

    def left(given: Sequence[Array]) -> float:
        white = [problem.whitened(index, residual) for index, residual in enumerate(given)]
        rest = fit.linearisation.without_starts(white)
        return float(np.sum((rest - others @ (others.T @ rest)) ** 2))

    with np.errstate(over="ignore", invalid="ignore"):
        rise = left(residuals) - left(fit.residuals)
    return rise if math.isfinite(rise) else math.inf


def _within(fit: Fit, way: _Way) -> bool:
    """Whether a step ends before its parameter's bound and within a meaningful multiple of the parameter's value.

    The value of a phase is no scale.
    """
    far = abs(way.deviations) * math.sqrt(fit.covariance[way.place, way.place])
    phase = math.isfinite(_half_turn(fit, way.place))
    near = (phase or far < BEYOND * abs(fit.values[way.place])) and abs(way.deviations) <= WIDEST
    return near and _moved(fit, way) is not None


def _half_turn(fit: Fit, place: int) -> float:
    """Half the period of a phase; infinite for other parameters."""
    return 0.5 * fit.model.turns.get(fit.names[place], math.inf)


def _again(fit: Fit, way: _Way, pool: ThreadPoolExecutor | None) -> tuple[float, Model]:
    """Rise of chi2 at the end of a step after refitting the other parameters, and the model there."""
    model = _moved(fit, way)
    if model is None:
        return math.inf, fit.model
    others = [name for place, name in enumerate(fit.names) if place != way.place]
    steps, state_steps = fit.differences
    try:
        end = descend(
            model, fit.run, others, fit.noise, fit.starts, ITERATIONS, pool,
            differences=(np.delete(steps, way.place), state_steps),
        )  # fmt: skip
    except InputError:
        return math.inf, fit.model
    return end.chi2 - fit.chi2, end.model


def _descended(found: Search, model: Model, pool: ThreadPoolExecutor | None) -> Search | None:
    """The search refitted from a model; None where chi2 does not become lower."""
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
    """The fit with 95 % intervals of at least the half-width `reach` (p,); an undetermined parameter becomes uncorrelated."""
    std = np.sqrt(np.diag(fit.covariance))
    factors = np.ones(len(std))
    known = (std > 0.0) & np.isfinite(std)
    factors[known] = np.maximum(1.0, reach[known] / (END * std[known]))
    open_ones = np.isinf(factors)
    factors[open_ones] = 0.0
    covariance = fit.covariance * np.outer(factors, factors)
    covariance[open_ones, open_ones] = math.inf
    return replace(fit, covariance=covariance)


def finely_stepped(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """Refit the chosen model of a search with integration steps so short that they do not bias the estimates.

    The search compares models, for which an integration error of a tenth of the noise does not matter. It matters for estimates:
    the error is the same in every period of the motion, so that over ten thousand samples a hundredth of the noise can shift an
    estimate by a standard deviation. Returns the search unchanged where no effect was chosen, because that fit already used them, or where the model diverges.
    """
    if not found.best.added:
        return found
    fit = found.fit
    tolerance = INTEGRATION * fit.noise.variance**0.5
    run = halved(sufficient(fit.run, fit.model, fit.starts, tolerance, HALVINGS - 1))
    try:
        fine = minimise(
            fit.model, run, fit.names, fit.noise, fit.starts, pool=pool, differences=fit.differences
        )
    except InputError:
        return found
    return replace(found, fit=fine)


def ticks_followed(found: Search, pool: ThreadPoolExecutor | None = None) -> Search:
    """The search with the likeliest period (and input delay) of a drive's clock, and intervals that cover the likely values.

    The likelihood of the tick period is discontinuous (`tick_likelihood`), so that its curvature gives no interval. The likeliest of all
    values tried around the fit is kept. The intervals of period and delay cover all values with a similar chi2, and sensitivities are
    differences across them. Unchanged unless the search has added a clock and its period is free.
    """
    period = clock_of(found.fit.model)
    if period is None or period.split(".")[0] not in found.best.added or period not in found.fit.names:
        return found
    fit = found.fit
    places = places_of(fit)
    cases, costs = tried(fit, places, (), pool)
    likely = cases[costs < costs.min() + LIKELY]
    others = [name for place, name in enumerate(fit.names) if place not in places]
    try:
        best = moved_to(fit, places, cases[np.argmin(costs)])
        again = minimise(best, fit.run, others, fit.noise, fit.starts, pool=pool)
        if again.chi2 > fit.chi2:  # the other parameters do not follow linearly; the earlier fit is better
            again = fit
        values = np.array([again.model.value(name) for name in fit.names])
        reach = np.max(np.abs(likely - values[places]), axis=0)
        covariance = _across_jumps(fit, again.model, places, reach, pool)
    except InputError:
        return found
    new = replace(
        again, names=fit.names, values=values, covariance=covariance, linearisation=fit.linearisation
    )
    far = np.array([END * fit.std[name] for name in fit.names])
    far[places] = reach
    return settled_at(found, widened(new, far))


def _across_jumps(
    fit: Fit, model: Model, places: Sequence[int], reach: Array, pool: ThreadPoolExecutor | None
) -> Array:
    """Covariance (p, p) with the sensitivities to period and delay as differences across the likely range and its jumps."""
    jacobian = fit.linearisation.jacobian.copy()
    for place, step in zip(places, reach):
        name = fit.names[place]
        step = max(step, END * fit.std[name] if np.isfinite(fit.std[name]) else 0.0)
        if step == 0.0:
            continue
        low, high = model.parameters[name].bounds  # the delay of a nuisance may be negative
        values = np.clip(model.value(name) + step * np.array([1.0, -1.0]), low, high).tolist()
        ends = [model.with_values({name: value}) for value in values]
        outputs = fit.run.many([(end, fit.starts) for end in ends], pool)
        if outputs[0] is None or outputs[1] is None:
            raise InputError("the model diverges within the interval of a hold's period")
        change = white_residual(fit, [up - down for up, down in zip(*outputs)])
        jacobian[:, place] = change / (values[0] - values[1])
    return covariance_of(jacobian, [model.parameters[name].prior for name in fit.names])
