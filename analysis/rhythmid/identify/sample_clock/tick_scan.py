"""Scan for the period of a drive's clock: the likelihood has a peak that is too narrow for a descent to find.

An error dP of the period P moves the ticks by T dP / P after a time T. Beyond half a period the likelihood no
longer depends on their phase. It still depends on the attenuation by the hold, which gives the rate 1/P
approximately. A coarse scan therefore selects a band of rates. Slow rates are always added to it: their images of
the command lie where the machine responds, and ticks of the wrong phase hide the right rate there. The rates are
tried on a grid of 1 / (4 T), over a first stretch if the whole record needs too many. The best distinct rates are
followed on finer and finer grids, until the last tick of the record is known to a small share of a sample. The mean
delay, of which half a period is due to the hold, is fixed at first. At the end it is shifted a little with the
rate, because it decides which command a tick takes. The effect of small changes of the other parameters and of the
initial states is projected off each residual.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import time_is_up
from rhythmid.errors import InputError
from rhythmid.identify.free_run import FreeRun, prepare_run
from rhythmid.identify.multiple_shooting import split
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import minimise
from rhythmid.identify.sample_clock.clock import clock_of
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
COARSE = 50  # rates of the coarse scan
# fraction of the way from the best to the median cost of the coarse scan, below which a rate is in the band
BAND = 0.5
SLOW = 2.5  # multiple of the slowest rate up to which rates are added to the band
MOST_RATES = 3000  # rates tried over the first stretch
SERIES = 2  # series used at first: those with the strongest command
SLOWEST = 2.0  # slowest rate as a multiple of the motion's dominant frequency
FASTEST = 100.0  # [Hz] above this rate a hold acts like a delay, and its ticks do not matter
FOLLOWED, LEAST = 24, 6  # number of rates followed at first and at the end
APART = 0.25  # least difference of two rates, times the length of the stretch
FOUND = 2  # number of guesses returned
FINEST = 0.001  # range of the last grid, over the inverse length of the record
FINER = 0.4  # ratio of successive grid ranges, two grid steps: the cost is rough over one step
STEPS = np.linspace(-1.0, 1.0, 11)
SHIFTS = np.linspace(-1.0, 1.0, 5)


def scanned(
    model: Model, series: Sequence[Series], starts: Sequence[Array], noise: NoiseModel
) -> list[dict[str, float]]:
    """First guesses of period and delay [s] of a model with an independent clock, best first; empty where no rate
    is possible.

    `starts` are the initial states of the series; the other parameters stay at the model's values.
    """
    period = clock_of(model)
    mean = model.parameters[INPUT_DELAY].value if INPUT_DELAY in model.parameters else 0.0
    driven = [(one, start) for one, start in zip(series, starts) if one.commanded and one.kind == "force"]
    if period is None or mean <= 0.0 or not driven:
        return []
    slowest = max(0.45 / mean, SLOWEST * max(dominant_frequency(one) for one, _ in driven))
    fastest = min(FASTEST, 0.5 / max(one.period for one, _ in driven))
    if slowest >= fastest:
        return []
    driven.sort(key=lambda case: -_strength(case[0]))
    chosen = [one for one, _ in driven[:SERIES]]
    begin = [start for _, start in driven[:SERIES]]
    longest = max(one.time[-1] - one.time[0] for one in chosen)

    def guess(rate: float, shift: float) -> dict[str, float]:
        return {period: float(1.0 / rate), INPUT_DELAY: float(max(mean - 0.5 / rate + shift, 0.0))}

    def best_of(length: float, cases: Array, middle: Array) -> tuple[Array, Array]:
        """The cases (n, 2) of rate and shift, best first, with their costs over stretches of this length."""
        stretches = [split(one, length)[0] for one in chosen]
        run = prepare_run(model, stretches)  # long steps: all cases share their error
        costs = _costs(run, model.with_values(guess(*middle)), [guess(*case) for case in cases], begin, noise)
        order = np.argsort(costs)
        return cases[order], costs[order]

    whole = 1.01 * longest
    rates = np.geomspace(slowest, fastest, COARSE)
    cases, costs = best_of(whole, _unshifted(rates), np.array([np.sqrt(slowest * fastest), 0.0]))
    if not np.isfinite(costs).any():
        return []
    near = cases[costs <= costs[0] + BAND * (np.median(costs) - costs[0]), 0]
    low, high = near.min() / 1.05, near.max() * 1.05
    slow = min(SLOW * slowest, low)
    length = min(whole, 0.25 * MOST_RATES / (high - low + slow - slowest))
    reach, late = 0.25 / length, 0.5 * chosen[0].period
    rates = np.concatenate([np.arange(slowest, slow, reach), np.arange(low, high, reach)])
    cases, _ = best_of(length, _unshifted(rates), cases[0])
    followed, shifts = FOLLOWED, np.zeros(1)
    while reach > FINEST / longest and not time_is_up():
        around = [(step * reach, shift) for step in STEPS for shift in shifts]
        cases = _apart(cases, followed, APART / length)
        length = min(2.0 * length, whole)
        tried = (cases[:, None, :] + np.array(around)).reshape(-1, 2)
        cases, _ = best_of(length, np.unique(np.round(tried, 9), axis=0), cases[0])
        reach, late, shifts = FINER * reach, 0.5 * late, late * SHIFTS
        followed = max(followed // 2, LEAST)
    return [guess(*case) for case in _apart(cases, FOUND, APART / longest)]


def _apart(cases: Array, count: int, least: float) -> Array:
    """The first `count` of the cases (n, 2) whose rates differ by more than `least` from all before them."""
    kept: list[Array] = []
    for case in cases:
        if len(kept) == count:
            break
        if all(abs(case[0] - other[0]) > least for other in kept):
            kept.append(case)
    return np.array(kept)


def _unshifted(rates: Array) -> Array:
    return np.column_stack([rates, np.zeros_like(rates)])


def _strength(series: Series) -> float:
    assert series.command is not None
    return float(np.std(series.command(series.centres)))


def _costs(
    run: FreeRun,
    middle: Model,
    guesses: Sequence[dict[str, float]],
    starts: Sequence[Array],
    noise: NoiseModel,
) -> Array:
    """Whitened sums of squares of the guesses, less what the model's other parameters can explain at `middle`."""
    names = tuple(name for name in middle.free if name != clock_of(middle))
    try:
        linearisation = minimise(middle, run, names, noise, starts, iterations=0).linearisation
    except InputError:
        return np.full(len(guesses), np.inf)
    problem = Problem(run, names, noise, None)
    left, _ = np.linalg.qr(linearisation.jacobian)
    costs = np.full(len(guesses), np.inf)
    for number, guess in enumerate(guesses):
        residuals = problem.residuals(middle.with_values(guess), starts)
        if residuals is None:
            continue
        white = [problem.whitened(i, r) for i, r in enumerate(residuals)]
        joined = linearisation.without_starts(white)
        costs[number] = float(joined @ joined) - float(np.sum((left.T @ joined) ** 2))
    return costs
