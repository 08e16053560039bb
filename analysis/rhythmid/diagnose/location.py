"""Locate a mismatch without naming it: which quantity does the missing force (or sensor error) depend on?

The missing force is written as an unknown smooth function of one quantity (position, velocity, both, actuator force, time), as
what a few filters, of first order and resonant, remember of the velocity or of the actuator's force, as what springs that slip
remember of the position, or as a vibration; the sensor's error as a function of its output. Each is a sum of functions whose effects
on the free run are simulated; to first order, that is another hypothesis: a free map beside the model. What it predicts of blocks that
were left out tells where the mismatch lives, and whether the names leave something that another explanation would predict. It also
draws what the catalogue has no name for.
"""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.signal import lfilter

from rhythmid.diagnose.contenders import Rows, linearised
from rhythmid.diagnose.evidence import CrossValidated, Linearised, cross_validate
from rhythmid.diagnose.search.score_tests import Trajectories, residual_line
from rhythmid.identify.output_error import Fit
from rhythmid.identify.series import Series
from rhythmid.simulation.signal import first_order_hold

Array = NDArray[np.float64]
SPLINES, SPLINES_OF_TWO = 8, 5  # basis functions of one quantity, and of each of two
TIME_CONSTANTS = (0.003, 0.01, 0.03, 0.1, 0.3)  # of filters that remember, in periods of the motion
# of filters that resonate at the residual's strongest line: a light and a heavy one, between which those of real second modes lie
DAMPING_RATIOS = (0.03, 0.2)
# displacements at which springs slip, in ranges of the position: those of other springs lie between (a sum of such springs is any
# hysteresis of Prandtl and Ishlinskii: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions, 1996, chapter 2)
SLIPS = (0.015, 0.05, 0.1, 0.2, 0.3)
RIDGE = 1e-4  # prior precision of a coefficient, relative to the information that all rows have of it
# quantities of which the free function is a spline, with the name of the same map in the simulator
SPLINED = {
    "position": "position",
    "velocity": "velocity",
    "actuator force": "effort",
    "measured position (sensor error)": "signal",
}


@dataclass(frozen=True)
class FreeMap:
    """A free function: `columns[i][s]` is the change of series s's block averages for a unit of its i-th coefficient.

    `grid` and `basis` (i, g) draw a function of one quantity; both are empty for others.
    """

    quantity: str
    columns: tuple[tuple[Array, ...], ...]
    grid: Array
    basis: Array


@dataclass(frozen=True)
class Dependence:
    """How much of the residual a free function of `quantity` explains.

    `explained` is the share of the residual's sum of squares above the noise in blocks left out of the fit (at most 1, below 0
    where it only fits noise). `grid` and `force` draw a function of one quantity; the unit is the model's force, or its
    position for a sensor error. `found` are the errors of prediction.
    """

    quantity: str
    explained: float
    grid: Array
    force: Array
    found: CrossValidated


def _splines(values: Sequence[Array], count: int) -> tuple[list[list[Array]], Array, Array]:
    """Cubic B-splines over the middle 99.8 % of the values: functions of each series, a grid, the functions on it."""
    joined = np.concatenate(values)
    low, high = np.quantile(joined, [0.001, 0.999])
    if high <= low:
        return [], np.empty(0), np.empty((0, 0))
    degree = 3
    inner = np.linspace(low, high, count - degree + 1)
    knots = np.concatenate([[low] * degree, inner, [high] * degree])
    splines = [BSpline.basis_element(knots[i : i + degree + 2], extrapolate=False) for i in range(count)]
    top = high - 1e-12 * (high - low)
    functions = [[np.nan_to_num(spline(np.clip(v, low, top))) for v in values] for spline in splines]
    grid = np.linspace(low, top, 60)
    return functions, grid, np.array([np.nan_to_num(spline(grid)) for spline in splines])


def _remembered(values: Sequence[Array], times: Sequence[Array], frequency: float) -> list[list[Array]]:
    """What first-order filters remember of signals: one function for each time constant."""
    found = []
    for share in TIME_CONSTANTS:
        function = []
        for value, time in zip(values, times):
            keep = math.exp(-float(np.median(np.diff(time))) * frequency / share)
            begin = [keep * value[0]]
            function.append(np.asarray(lfilter([1.0 - keep], [1.0, -keep], value, zi=begin)[0]))
        found.append(function)
    return found


def _resonant(values: Sequence[Array], times: Sequence[Array], line: float) -> list[list[Array]]:
    """What filters that resonate at the frequency `line` [Hz] remember of signals, in phase with their force and a quarter turn
    ahead: a part on a spring moves like one of them, whatever its damping ratio between theirs."""
    found = []
    for ratio in DAMPING_RATIOS:
        pairs = []
        for value, time in zip(values, times):
            turn = 2.0 * math.pi * line * float(np.median(np.diff(time)))
            radius, angle = math.exp(-ratio * turn), math.sqrt(1.0 - ratio**2) * turn
            pole = [1.0, -2.0 * radius * math.cos(angle), radius**2]
            level = value - value.mean()
            pairs.append([lfilter([0.0, turn * radius], pole, level), lfilter([1.0, -radius], pole, level)])
        found += [[np.asarray(pair[0]) for pair in pairs], [np.asarray(pair[1]) for pair in pairs]]
    return found


def _slipped(values: Sequence[Array]) -> list[list[Array]]:
    """What springs that slip remember of signals: one function for each displacement at which they slip. A sum of them is any hysteresis
    that does not depend on speed and whose loops are alike wherever they begin."""
    reach = max(float(np.ptp(value)) for value in values)
    return [[stretched(value, share * reach) for value in values] for share in SLIPS]


def stretched(values: Array, most: float) -> Array:
    """How far a spring is stretched whose end follows a signal (n,) and which slips at `most` in either direction; at first it is not."""
    held = accumulate(values.tolist(), lambda foot, value: min(max(foot, value - most), value + most))
    return values - np.fromiter(held, dtype=np.float64, count=len(values))


def _simulated(
    known: Trajectories, functions: list[list[Array]], pool: ThreadPoolExecutor | None
) -> tuple[tuple[Array, ...], ...]:
    """Outputs' changes when each function acts as a force; its size is chosen small and scaled back."""
    run, fit = known.disturbed, known.fit
    scale = (
        1e-3 * fit.model.mass.value * max(float(np.std(np.gradient(p.velocity, p.time))) for p in known.paths)
    )

    def one(function: list[Array]) -> tuple[Array, ...]:
        size = max(float(np.abs(values).max()) for values in function) or 1.0
        changes = []
        for index, (series, path) in enumerate(zip(run.series, known.paths)):
            push = first_order_hold(path.time, scale / size * function[index])
            rows = run.rows(fit.model, index, fit.starts[index], push)
            if rows is None:
                changes.append(np.zeros(series.blocks))
            else:
                change = series.of_block(rows[:, run.states] - known.outputs[index])
                changes.append(change * size / scale)
        return tuple(changes)

    return tuple(pool.map(one, functions)) if pool else tuple(one(function) for function in functions)


def values_of(known: Trajectories, name: str) -> list[Array]:
    """Values of the quantity that a spline depends on, of each series; `name` is that of the simulator's map, as in `SPLINED`."""
    values: dict[str, list[Array]] = {
        "position": [path.position for path in known.legs],
        "velocity": [path.velocity for path in known.legs],
        "effort": [path.effort for path in known.paths],
        "signal": list(known.outputs),
    }
    return values[name]


def free_maps(known: Trajectories, pool: ThreadPoolExecutor | None = None) -> Iterator[FreeMap]:
    """The free functions beside a fitted model, each made when it is asked for: over long records each is large."""
    fit = known.fit
    none, nowhere = np.empty(0), np.empty((0, 0))
    moving = any(np.ptp(p.effort) > 0 for p in known.paths)
    quantities: dict[str, list[Array]] = {
        "position": values_of(known, "position"),
        "velocity": values_of(known, "velocity"),
        "time": [p.time - p.time[0] for p in known.paths],
    }
    if moving:
        quantities["actuator force"] = values_of(known, "effort")
    for name, values in quantities.items():
        functions, grid, basis = _splines(values, SPLINES)
        if functions:
            yield FreeMap(name, _simulated(known, functions, pool), grid, basis)
    both = [_splines(quantities[name], SPLINES_OF_TWO)[0] for name in ("position", "velocity")]
    if all(both):
        products = [[a * b for a, b in zip(x, v)] for x in both[0] for v in both[1]]
        yield FreeMap("position and velocity", _simulated(known, products, pool), none, nowhere)
    yield FreeMap("past position", _simulated(known, _slipped(quantities["position"]), pool), none, nowhere)
    times = [p.time for p in known.paths]
    frequency = _frequency(known)
    past = {"past velocity": quantities["velocity"]}
    if moving:
        past["past actuator force"] = quantities["actuator force"]
    line = residual_line(fit)
    for name, values in past.items():
        functions = _remembered(values, times, frequency)
        if line > 0.0:
            functions += _resonant(values, times, line)
        yield FreeMap(name, _simulated(known, functions, pool), none, nowhere)
    if line > 0.0:
        waves = [[wave(2.0 * np.pi * line * t) for t in times] for wave in (np.cos, np.sin)]
        yield FreeMap(f"a vibration at {line:.3g} Hz", _simulated(known, waves, pool), none, nowhere)
    functions, grid, basis = _splines(values_of(known, "signal"), SPLINES)
    if functions:
        columns = tuple(tuple(s.of_block(f) for s, f in zip(fit.run.series, one)) for one in functions)
        yield FreeMap("measured position (sensor error)", columns, grid, basis)


def _frequency(known: Trajectories) -> float:
    """Typical frequency of the motion [Hz]: rms of the velocity over that of the position."""
    velocity = max(float(np.std(p.velocity)) for p in known.paths)
    position = max(float(np.std(p.position)) for p in known.paths)
    return velocity / max(2.0 * math.pi * position, 1e-300)


@dataclass(frozen=True)
class Reach:
    """What parameters and the initial state do to whitened rows of one series that its fit does not see.

    Without it a free map would be predicted with parameters that were fitted without it. `parameters` (h, p), with the initial
    state fitted again; `starts` (h, q), and (n, q) of the rows that the fit sees as `seen`.
    """

    parameters: Array
    starts: Array
    seen: Array

    def refitted(self, seen: Array, hidden: Array) -> Array:
        """What is left of changes of the hidden rows (h, k) once the initial state is fitted to those of the seen ones (n, k)."""
        norms = np.linalg.norm(self.seen, axis=0)
        norms[norms == 0.0] = 1.0
        taken = np.linalg.lstsq(self.seen / norms, seen, rcond=1e-7)[0]
        return hidden - self.starts / norms @ taken


def _white(rows: Rows, one: Series, values: Array, parts: Sequence[slice]) -> Array:
    white = [rows.noise.whiten(one.levelled(values[part], part)) for part in parts]
    return np.concatenate(white or [values[:0]])


def reach_of(fit: Fit, rows: Rows, pool: ThreadPoolExecutor | None = None) -> list[Reach]:
    """How each series' hidden rows depend on the fit's parameters and starts."""
    model, (steps, state_steps) = fit.model, (fit.linearisation.steps, fit.linearisation.state_steps)
    moved = [model.with_values({name: model.value(name) + step}) for name, step in zip(fit.names, steps)]
    cases = [(one, fit.starts) for one in moved]
    cases += [(model, tuple(start + shift for start in fit.starts)) for shift in np.diag(state_steps)]
    outputs = fit.run.many(cases, pool)
    scale, p = np.concatenate([steps, state_steps]), len(fit.names)
    found = []
    for index, (series, residual) in enumerate(zip(fit.run.series, fit.residuals)):
        change = np.zeros((series.blocks, len(scale)))
        for column, output in enumerate(outputs):
            if output is not None:
                change[:, column] = (output[index] - series.averaged - residual) / scale[column]
        seen, hidden = (_white(rows, series, change, which[index]) for which in (rows.seen, rows.hidden))
        plain = Reach(hidden[:, :p], hidden[:, p:], seen[:, p:])
        found.append(Reach(plain.refitted(seen[:, :p], hidden[:, :p]), plain.starts, plain.seen))
    return found


def following(base: Linearised, rows: Rows, reach: Sequence[Reach]) -> Linearised:
    """The fit whose parameters reach the hidden rows, too; separate held-out records are predicted as it stands."""
    jacobian = base.jacobian.copy()
    hidden = np.concatenate([one.parameters for one in reach])
    jacobian[rows.fitted : rows.fitted + len(hidden)] = hidden
    return Linearised(base.residual, jacobian, base.precision, base.departure)


def beside(fit: Fit, base: Linearised, one: FreeMap, rows: Rows, reach: Sequence[Reach]) -> Linearised:
    """The fit, which reaches the hidden rows, with a free map beside it, to first order. Separate held-out records are predicted
    as without it."""
    seen, hidden = [], []
    for index, basis in enumerate(fit.linearisation.bases):
        columns = np.column_stack([column[index] for column in one.columns])
        series = fit.run.series[index]
        white = _white(rows, series, columns, rows.seen[index])
        seen.append(white - basis @ (basis.T @ white))
        hidden.append(reach[index].refitted(white, _white(rows, series, columns, rows.hidden[index])))
    added = np.concatenate([*seen, *hidden])
    wide = np.zeros((len(base.residual), added.shape[1]))
    wide[: len(added)] = added
    information = np.sum(added[: rows.fitted] ** 2, axis=0)
    count = added.shape[1]
    return Linearised(
        base.residual,
        np.hstack([base.jacobian, wide]),
        np.concatenate([base.precision, RIDGE * np.maximum(information, 1e-300)]),
        np.concatenate([base.departure, np.zeros(count)]),
    )


def dependences(known: Trajectories, rows: Rows, pool: ThreadPoolExecutor | None = None) -> list[Dependence]:
    """Dependence of what a fit leaves on each quantity, the one that predicts best first."""
    fit = known.fit
    reach = reach_of(fit, rows, pool)
    base = following(linearised(fit, rows), rows, reach)
    alone = cross_validate(base, rows.blocks)
    before = float(np.sum(alone.error**2))
    n = len(alone.error)
    found: list[Dependence] = []
    for one in free_maps(known, pool):
        wide = beside(fit, base, one, rows, reach)
        predicted = cross_validate(wide, rows.blocks)
        coefficients = _coefficients(wide, rows.fitted)[-len(one.columns) :]
        left = float(np.sum(predicted.error**2))
        floor = min(float(n), left)
        whole = max(before - floor, 1e-9 * before, 5.0 * math.sqrt(2.0 * n))
        drawn = coefficients @ one.basis if one.basis.size else np.empty(0)
        explained = float(np.clip((before - left) / whole, -1.0, 1.0))
        found.append(Dependence(one.quantity, explained, one.grid, drawn, predicted))
    return sorted(found, key=lambda d: -d.explained)


def _coefficients(fit: Linearised, fitted: int) -> Array:
    """Least-squares change of all parameters on the rows that the fit sees."""
    jacobian, residual = fit.jacobian[:fitted], fit.residual[:fitted]
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1.0
    scaled = jacobian / norms
    normal = scaled.T @ scaled + np.diag(fit.precision / norms**2)
    pull = fit.precision * fit.departure / norms
    return -np.linalg.lstsq(normal, scaled.T @ residual + pull, rcond=1e-12)[0] / norms
