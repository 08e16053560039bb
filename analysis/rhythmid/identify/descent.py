"""Levenberg-Marquardt search for the parameters and initial states whose free run fits the records.

The initial state of every series is a nuisance parameter. It is eliminated from each step by projection (variable
projection, G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413, in the form of L. Kaufman, BIT 15 (1975)
49). So the size of the normal equations is the number of parameters, however many series there are.
"""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, time_is_up
from rhythmid.errors import InputError
from rhythmid.identify.free_run import FreeRun, start_of
from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.sensitivity import Linearisation, Problem, state_update
from rhythmid.identify.series import dominant_frequency
from rhythmid.identify.start_memory import sought
from rhythmid.model import Model
from rhythmid.value import Prior

Array = NDArray[np.float64]
NOTHING: Mapping[str, float] = MappingProxyType({})
WHITE = NoiseModel(np.empty(0), 1.0)
LEAST_DAMPING = 1e-6  # damping up to which a step counts as a full Gauss-Newton step
STATES = 0.01  # damping above which every state is damped in a step
# share of its distance from a lower bound that one step leaves a parameter: a width of zero is hard to leave again
STAY = 0.1
PACE = 3  # iterations over which the present rate of decline is measured
BRINK = 1e-3  # share of the first distance below which a parameter may reach the bound


def first_guess(model: Model, run: FreeRun) -> list[Array]:
    """State at the first block of each series: position and slope of a straight line fitted to its first samples."""
    found: list[Array] = []
    for index, one in enumerate(run.series):
        span = 0.05 / max(dominant_frequency(one), 1e-9)
        n = int(np.clip(round(span / one.period), 3, max(len(one.time) // 4, 3)))
        slope, level = np.polyfit(one.time[:n] - one.time[0], one.value[:n], 1)
        begin = {"position": (level, slope), "velocity": (one.origin, level), "acceleration": (0.0, 0.0)}[
            one.measured
        ]
        if one.kind == "base_displacement" and one.command is not None and one.measured != "position":
            begin = float(one.command(one.centres[0])), begin[1]  # at rest on the base
        found.append(start_of(model, run, index, float(begin[0]), float(begin[1])))
    return found


def _first_steps(model: Model, names: Sequence[str], run: FreeRun) -> Array:
    steps = []
    for name in names:
        value = model.parameters[name]
        low, high = value.bounds
        size = abs(value.value)
        if size == 0.0:
            size = min(run.series[0].period, 1.0) if value.unit == "s" else 1e-2
            if math.isfinite(high) and math.isfinite(low):
                size = 0.1 * (high - low)
        steps.append(1e-4 * size)
    return np.array(steps)


def _settled_steps(
    problem: Problem,
    model: Model,
    starts: Sequence[Array],
    residuals: Sequence[Array],
    similar: Mapping[str, float],
) -> tuple[Array, Array]:
    """Finite-difference steps of parameters (p,) and initial states (q,), taken from a similar structure where it
    has them."""
    run, names = problem.run, problem.names
    every = [*names, *run.compiled.layout.states]
    velocity = 2 * np.pi * max(dominant_frequency(one) for one in run.series) * problem.spread
    state_steps = 1e-4 * np.array([problem.spread, velocity, *([problem.spread] * (run.states - 2))])
    guessed = np.append(_first_steps(model, names, run), state_steps)
    steps = np.array([similar.get(name, guess) for name, guess in zip(every, guessed, strict=True)])
    known = [name in similar for name in every]
    p = len(names)
    return problem.settle_steps(model, starts, residuals, steps[:p], steps[p:], known)


def _step(
    jacobian: Array, residual: Array, damping: float, blocked: NDArray[np.bool_], least: Array, most: Array
) -> Array:
    """Levenberg-Marquardt step (p,) in the parameters that are not blocked at a bound. A component that would pass
    `least` or `most` (p,) stops there, and the step in the others is solved again."""
    free = ~blocked
    step = np.zeros(jacobian.shape[1])
    while free.any():
        j = jacobian[:, free]
        norms = column_norms(j)
        scaled = j / norms
        hessian = scaled.T @ scaled
        left = residual + jacobian[:, ~free] @ step[~free]
        step[free] = -np.linalg.lstsq(
            hessian + damping * np.eye(len(hessian)), scaled.T @ left, rcond=1e-13
        )[0] / norms  # fmt: skip
        outside = free & ((step < least) | (step > most))
        if not outside.any():
            break
        step[outside] = np.clip(step, least, most)[outside]
        free &= ~outside
    return step


def _with_priors(here: Linearisation, priors: Sequence[Prior | None], values: Array) -> tuple[Array, Array]:
    """Jacobian (n + k, p) and residual (n + k,) with one more row for each of the k priors."""
    known = [(i, prior) for i, prior in enumerate(priors) if prior is not None]
    if not known:
        return here.jacobian, here.residual
    extra: Array = np.zeros((len(known), len(values)))
    for row, (i, prior) in enumerate(known):
        extra[row, i] = 1.0 / prior.std
    distance = [(values[i] - prior.mean) / prior.std for i, prior in known]
    return np.vstack([here.jacobian, extra]), np.concatenate([here.residual, distance])


def restarted(
    problem: Problem, model: Model, starts: Sequence[Array], residuals: Sequence[Array]
) -> tuple[list[Array], list[Array]]:
    """For each series the better of its start and the one that its first samples show, with the residuals.

    A start that was fitted beside another model may lie behind a switch of the new one, such as a touch-down, which no descent passes.
    """
    shown = first_guess(model, problem.run)
    others = problem.residuals(model, shown)
    if others is None:
        return list(starts), list(residuals)
    both = [list(zip(starts, residuals, strict=True)), list(zip(shown, others, strict=True))]
    best = [
        min(two, key=lambda one: float(np.sum(problem.whitened(index, one[1]) ** 2)))
        for index, two in enumerate(zip(*both, strict=True))
    ]
    return [start for start, _ in best], [left for _, left in best]


@dataclass(frozen=True)
class Descent:
    """End of a search for the best parameters: the content of a `Fit`, without the sensitivities there.

    `differences` are the finite-difference steps (p,) and (q,) of parameters and initial states for the sensitivities.
    `linearisation` is present where the last one was computed at the end point itself.
    """

    model: Model
    starts: tuple[Array, ...]
    residuals: tuple[Array, ...]
    chi2: float
    samples: int
    converged: bool
    message: str
    at_bound: tuple[str, ...]
    differences: tuple[Array, Array]
    linearisation: Linearisation | None


@dataclass(frozen=True)
class _Point:
    """Parameters and initial states, with the residuals and the cost (chi2 and priors) there."""

    model: Model
    starts: list[Array]
    residuals: list[Array]
    cost: float


@dataclass(frozen=True)
class _Limits:
    """Bounds (p,) and priors of the parameters; only below its `brink` (p,) a parameter reaches its lower bound in one step.

    `held` (q,) is 1 for memory states, whose steps are always damped.
    """

    names: Sequence[str]
    low: Array
    high: Array
    brink: Array
    priors: Sequence[Prior | None]
    held: Array

    @classmethod
    def of(cls, problem: Problem, model: Model) -> "_Limits":
        """The limits of a descent that begins at this model."""
        known = [model.parameters[name] for name in problem.names]
        low: Array = np.array([one.bounds[0] for one in known])
        high: Array = np.array([one.bounds[1] for one in known])
        brink = [a + BRINK * (one.value - a) if math.isfinite(a) else math.inf for one, a in zip(known, low)]
        memories, states = problem.run.compiled.layout.memories, problem.run.states
        held: Array = np.array([float(place in memories) for place in range(states)])
        return cls(problem.names, low, high, np.array(brink), [one.prior for one in known], held)


@dataclass(frozen=True)
class _Tangent:
    """A point's linearisation, with a row of `jacobian` and `residual` for each prior.

    `series` are each series' whitened residual and sensitivities to parameters and initial states; `state_steps` (q,) are
    the units of the latter. Parameters that are `blocked` (p,) would pass the bound at which they are.
    """

    limits: _Limits
    values: Array
    jacobian: Array
    residual: Array
    blocked: NDArray[np.bool_]
    series: Sequence[tuple[Array, Array, Array]]
    state_steps: Array

    @classmethod
    def of(
        cls,
        limits: _Limits,
        model: Model,
        here: Linearisation,
        series: Sequence[tuple[Array, Array, Array]],
        state_steps: Array,
    ) -> "_Tangent":
        """The tangent at a model."""
        values: Array = np.array([model.value(name) for name in limits.names])
        jacobian, residual = _with_priors(here, limits.priors, values)
        gradient = jacobian.T @ residual
        blocked = ((values <= limits.low) & (gradient > 0)) | ((values >= limits.high) & (gradient < 0))
        return cls(limits, values, jacobian, residual, blocked, series, state_steps)

    def step(self, point: _Point, damping: float) -> tuple[Model, list[Array], float, bool]:
        """Model and starts after a step with this damping, the cost that it promises, and whether it stops nowhere."""
        limits, values = self.limits, self.values
        floor: Array = np.array(
            [a + STAY * (v - a) if v > b else a for v, a, b in zip(values, limits.low, limits.brink)]
        )
        least, most = floor - values, limits.high - values
        taken = _step(self.jacobian, self.residual, damping, self.blocked, least, most)
        whole = bool(np.all(self.blocked | ((taken > least) & (taken < most))))
        proposed: Array = np.clip(values + taken, floor, limits.high)
        moved: list[Array] = []
        promised: float = _prior_cost(limits.priors, proposed)
        for start, (error, slope, state) in zip(point.starts, self.series):
            ahead = error + slope @ (proposed - values)
            # the other states are damped only where damping of parameters and memory states did not help
            change = state_update(state, ahead, damping * np.where(damping > STATES, 1.0, limits.held))
            moved.append(start + change * self.state_steps)
            promised += float(np.sum((ahead + state @ change) ** 2))
        return point.model.with_values(dict(zip(limits.names, proposed))), moved, promised, whole


def _begun(problem: Problem, model: Model, starts: Sequence[Array] | None) -> _Point:
    """The point at which a descent begins. Raises InputError where the model diverges there."""
    current = [np.array(s) for s in (starts if starts is not None else first_guess(model, problem.run))]
    problem.learn_hidden(model, current)
    residuals = problem.residuals(model, current)
    if starts is not None and residuals is not None:
        current, residuals = restarted(problem, model, current, residuals)
    cost = problem.cost(model, residuals, current)
    if residuals is None or not math.isfinite(cost):
        raise InputError(
            "the model diverges when simulated over the records with its initial values; check its parameters and units"
        )
    return _Point(model, current, residuals, cost)


def _lower(
    problem: Problem, model: Model, starts: list[Array], residuals: list[Array] | None, most: float
) -> _Point | None:
    """The point, if its cost is below `most`."""
    cost = problem.cost(model, residuals, starts)
    return _Point(model, starts, residuals, cost) if residuals is not None and cost < most else None


def _stepped(
    problem: Problem, tangent: _Tangent, point: _Point, damping: float, enough: float
) -> tuple[_Point, float, bool]:
    """The point after a step with as much damping as it needs, the next damping, and whether the descent has converged:
    the gain is below `enough`, or no direction lowers the cost further."""
    for _ in range(12):
        model, starts, promised, whole = tangent.step(point, damping)
        if whole and damping <= LEAST_DAMPING and point.cost - promised < enough:
            return point, damping, True
        lower = _lower(problem, model, starts, problem.residuals(model, starts), point.cost)
        if lower is not None:
            return lower, max(damping * 0.1, 1e-12), point.cost - lower.cost < enough
        damping = max(damping * 10.0, LEAST_DAMPING)
        if damping > 1e8:
            break
        if time_is_up():
            return point, damping, False
    return point, damping, True


def _from_other_starts(problem: Problem, tangent: _Tangent, point: _Point, enough: float) -> _Point | None:
    """A point with lower cost at the same parameters, from initial states that no descent reaches."""
    if tangent.limits.held.any():
        starts = sought(problem, point.model, point.starts, tangent.series, tangent.state_steps)
        residuals = problem.residuals(point.model, starts)
    else:
        starts, residuals = restarted(problem, point.model, point.starts, point.residuals)
    return _lower(problem, point.model, starts, residuals, point.cost - enough)


def descend(
    model: Model,
    run: FreeRun,
    names: Sequence[str],
    noise: NoiseModel = WHITE,
    starts: Sequence[Array] | None = None,
    iterations: int = 30,
    pool: ThreadPoolExecutor | None = None,
    tolerance: float = 1e-3,
    differences: tuple[Array, Array] | None = None,
    reach: float = math.inf,
    similar: Mapping[str, float] = NOTHING,
) -> Descent:
    """Levenberg-Marquardt from the model's own values.

    The search stops in three cases. A further step lowers chi2, or is predicted to lower it, by less than
    `tolerance` (less where the noise model proves too wide) or by less than 1e-7 of chi2. Or chi2 would not come
    down to `reach` in the iterations left, at the rate of the last `PACE` iterations. Or a deadline passes.
    A phase is told within half a turn of its value at the start.
    `differences` are finite-difference steps known from another descent of the same structure. Without them the
    steps of a `similar` descent are taken, by name of parameter or state, and the missing ones are computed. Raises
    InputError when the model diverges at its initial values.
    """
    problem = Problem(run, names, noise, pool)
    point = _begun(problem, model, starts)
    steps, state_steps = differences or _settled_steps(problem, model, point.starts, point.residuals, similar)
    limits = _Limits.of(problem, model)
    damping, converged, searched = LEAST_DAMPING, False, False
    blocked: NDArray[np.bool_] = np.zeros(len(names), bool)
    here: Linearisation | None = None
    samples = sum(len(problem.whitened(i, r)) for i, r in enumerate(point.residuals))
    costs = [point.cost]
    for done in range(iterations):
        if time_is_up():
            break
        if done >= PACE and out_of_reach(costs[-1 - PACE], point.cost, (iterations - done) / PACE, reach):
            break
        before, units = point, state_steps
        here, series, steps, state_steps = problem.linearise(
            point.model, point.starts, point.residuals, steps, state_steps
        )
        tangent = _Tangent.of(limits, point.model, here, series, units)
        blocked = tangent.blocked
        enough = max(tolerance * min(1.0, point.cost / samples), 1e-7 * point.cost)
        point, damping, converged = _stepped(problem, tangent, point, damping, enough)
        if converged and not searched:
            searched = bool(limits.held.any())
            other = _from_other_starts(problem, tangent, point, enough)
            if other is not None:
                point, damping, converged = other, LEAST_DAMPING, False
        here = here if point is before else None
        costs.append(point.cost)
        if converged:
            break
    white = [problem.whitened(i, r) for i, r in enumerate(point.residuals)]
    return Descent(
        model=point.model.unwound(model),
        starts=tuple(point.starts),
        residuals=tuple(point.residuals),
        chi2=float(sum(np.sum(w**2) for w in white)),
        samples=samples,
        converged=converged,
        message=_message(converged, iterations),
        at_bound=tuple(name for name, stuck in zip(names, blocked) if stuck),
        differences=(steps, state_steps),
        linearisation=here,
    )


def _message(converged: bool, iterations: int) -> str:
    """How a descent ended, in words."""
    if converged:
        return "converged"
    return SPENT if iterations and time_is_up() else f"no convergence in {iterations} iterations"


def out_of_reach(before: float, now: float, left: float, reach: float) -> bool:
    """Whether chi2, which fell from `before` to `now`, stays above `reach` if it falls by the same ratio `left`
    times more."""
    return now > reach and now * (now / before) ** left > reach


def _prior_cost(priors: Sequence, values: Array) -> float:
    return sum(
        ((value - prior.mean) / prior.std) ** 2 for prior, value in zip(priors, values) if prior is not None
    )
