"""Free functions beside a fitted model, for a force or a sensor error of unknown law.

A missing force is a smooth function of one quantity (position, velocity, both, actuator force, time), a vibration, or a
force with memory: first-order and resonant filters of the velocity or the actuator force, or slipping springs driven by the
position. A sensor error is a function of the sensor's output. Each free function is a sum of basis functions, whose
effects on the free run are simulated.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.signal import lfilter

from rhythmid.diagnose.search.score_tests import Trajectories, residual_line
from rhythmid.parallel import each

Array = NDArray[np.float64]
SPLINES, SPLINES_OF_TWO = 8, 5  # basis functions of one quantity, and of each of two quantities
TIME_CONSTANTS = (0.003, 0.01, 0.03, 0.1, 0.3)  # of first-order filters, in periods of the motion
# damping ratios of filters that resonate at the residual's strongest line; those of real second modes lie between them
DAMPING_RATIOS = (0.03, 0.2)
# displacements at which the springs slip, in ranges of the position; those of real springs lie between them. A sum of such
# springs is any Prandtl-Ishlinskii hysteresis (M. Brokate, J. Sprekels, Hysteresis and Phase Transitions, 1996, chapter 2)
SLIPS = (0.015, 0.05, 0.1, 0.2, 0.3)
# quantities of spline functions, with the name of the same map in the simulator
SPLINED = {
    "position": "position",
    "velocity": "velocity",
    "actuator force": "effort",
    "measured position (sensor error)": "signal",
}


@dataclass(frozen=True)
class FreeFunction:
    """A free function: `columns[i][s]` (blocks,) is the change of series s's block averages per unit of coefficient i.

    `grid` (g,) and `basis` (i, g) draw a function of one quantity; both are empty for others.
    """

    quantity: str
    columns: tuple[tuple[Array, ...], ...]
    grid: Array = field(default_factory=lambda: np.empty(0))
    basis: Array = field(default_factory=lambda: np.empty((0, 0)))


def _splines(values: Sequence[Array], count: int) -> tuple[list[list[Array]], Array, Array]:
    """Cubic B-splines over the middle 99.8 % of the values: functions of each series, a grid, and the functions on the grid."""
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
    """Signals after first-order filters: one function for each time constant."""
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
    """Signals after filters that resonate at the frequency `line` [Hz], in phase with the filter's force and 90° ahead.

    A part on a spring moves like a combination of these, for any damping ratio between theirs.
    """
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
    """Signals after slipping springs: one function for each displacement at which a spring slips.

    A sum of them is any rate-independent hysteresis whose loops have the same shape wherever they begin.
    """
    reach = max(float(np.ptp(value)) for value in values)
    return [[stretched(value, share * reach) for value in values] for share in SLIPS]


def stretched(values: Array, most: float) -> Array:
    """Extension (n,) of a spring, relaxed at first, whose end follows a signal (n,) and which slips at ±`most`."""
    held = accumulate(values.tolist(), lambda foot, value: min(max(foot, value - most), value + most))
    return values - np.fromiter(held, dtype=np.float64, count=len(values))


def _simulated(
    known: Trajectories, functions: Iterable[list[Array]], pool: ThreadPoolExecutor | None
) -> tuple[tuple[Array, ...], ...]:
    """Changes of the outputs when each function acts as a force."""

    def one(function: list[Array]) -> tuple[Array, ...]:
        changes = []
        for index, series in enumerate(known.disturbed.series):
            change = known.response(index, function[index])
            changes.append(np.zeros(series.blocks) if change is None else series.of_block(change))
        return tuple(changes)

    return tuple(each(one, functions, pool))


def values_of(known: Trajectories, name: str) -> list[Array]:
    """Values (n,) of a spline's quantity, one array for each series; `name` is that of the simulator's map, as in `SPLINED`."""
    return [getattr(path, name) for path in known.legs]


def free_functions(known: Trajectories, pool: ThreadPoolExecutor | None = None) -> Iterator[FreeFunction]:
    """The free functions beside a fitted model, computed on demand because each is large for long records."""
    fit = known.fit
    yield from motion_maps(known, pool)
    quantities: dict[str, list[Array]] = {"time": [p.time - p.time[0] for p in known.paths]}
    if _driven(known):
        quantities["actuator force"] = values_of(known, "effort")
    for name, values in quantities.items():
        functions, grid, basis = _splines(values, SPLINES)
        if functions:
            yield FreeFunction(name, _simulated(known, functions, pool), grid, basis)
    both = [_splines(values_of(known, name), SPLINES_OF_TWO)[0] for name in ("position", "velocity")]
    if all(both):
        products = ([a * b for a, b in zip(x, v)] for x in both[0] for v in both[1])
        yield FreeFunction("position and velocity", _simulated(known, products, pool))
    yield FreeFunction("past position", _simulated(known, _slipped(values_of(known, "position")), pool))
    yield from filtered(known, pool)
    line = residual_line(fit)
    if line > 0.0:
        times = [p.time for p in known.paths]
        waves = [[wave(2.0 * np.pi * line * t) for t in times] for wave in (np.cos, np.sin)]
        yield FreeFunction(f"a vibration at {line:.3g} Hz", _simulated(known, waves, pool))
    functions, grid, basis = _splines(values_of(known, "signal"), SPLINES)
    if functions:
        columns = tuple(tuple(s.of_block(f) for s, f in zip(fit.run.series, one)) for one in functions)
        yield FreeFunction("measured position (sensor error)", columns, grid, basis)


def motion_maps(known: Trajectories, pool: ThreadPoolExecutor | None = None) -> Iterator[FreeFunction]:
    """Forces that are arbitrary functions of the position, and of the velocity."""
    for name in ("position", "velocity"):
        functions, grid, basis = _splines(values_of(known, name), SPLINES)
        if functions:
            yield FreeFunction(name, _simulated(known, functions, pool), grid, basis)


def filtered(known: Trajectories, pool: ThreadPoolExecutor | None = None) -> Iterator[FreeFunction]:
    """Linear filters of the past velocity and of the past actuator force: a linear dynamic part that the model lacks."""
    times, frequency = [p.time for p in known.paths], _frequency(known)
    past = {"past velocity": values_of(known, "velocity")}
    if _driven(known):
        past["past actuator force"] = values_of(known, "effort")
    line = residual_line(known.fit)
    for name, values in past.items():
        functions = _remembered(values, times, frequency)
        if line > 0.0:
            functions += _resonant(values, times, line)
        yield FreeFunction(name, _simulated(known, functions, pool))


def _driven(known: Trajectories) -> bool:
    """Whether an actuator's force varies."""
    return any(np.ptp(path.effort) > 0 for path in known.paths)


def _frequency(known: Trajectories) -> float:
    """Typical frequency of the motion [Hz]: rms of the velocity over that of the position."""
    velocity = max(float(np.std(p.velocity)) for p in known.paths)
    position = max(float(np.std(p.position)) for p in known.paths)
    return velocity / max(2.0 * math.pi * position, 1e-300)
