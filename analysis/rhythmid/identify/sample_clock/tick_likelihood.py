"""Likelihood of the clock ticks of a drive: the clock's period and the delay before it.

A command that is held between timestamps waits for the drive's next tick. Wherever a tick passes a timestamp,
another command is held, and the likelihood of period and delay jumps. The jumps are nanoseconds of the period
apart, so the slope between two jumps is no guide over many of them, and a descent fails. So period and delay are
varied together on a grid around the fit, which is refined step by step. All other parameters follow linearly.

A hold of nearly the right period explains most of the effect. The first scan uses a noise model that contains the
whole unexplained effect. It is therefore repeated with the noise model of the remaining residual.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import time_is_up
from rhythmid.errors import InputError
from rhythmid.identify.least_squares import column_norms
from rhythmid.identify.output_error import Fit, minimise, noise_of
from rhythmid.identify.sample_clock.clock import clock_of
from rhythmid.identify.sample_clock.tick_scan import FINER, scanned
from rhythmid.identify.sensitivity import Problem
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
STEPS = np.linspace(-1.0, 1.0, 9)
WIDE, FINE = 0.2, 1e-4  # range of the grid at first and at the end: shift of the last tick in periods
SHIFTS = np.linspace(-1.0, 1.0, 7)
LEAST_MOVE = 0.25  # sample periods: least shift of the delay while ticks move by more than a sample
FOLLOWED = 4  # cases that are refined further
SCANS = 3  # largest number of scans, each with the noise model of the one before
NOTHING_NEW = 0.98  # ratio of chi2 above which a scan brings no improvement


def ticks_sought(fit: Fit, floor: float, pool: ThreadPoolExecutor | None = None) -> Fit:
    """The fit of a model with an independent clock, with the most likely ticks found under its residual noise model.

    The noise model is at least `floor` [unit of the measurement]; the fit is returned under it, unless the fit is
    unchanged.
    """
    period = clock_of(fit.model)
    if period is None or period not in fit.names:
        return fit
    series, places = fit.run.series, places_of(fit)
    for _ in range(SCANS):
        if time_is_up() or fit.model.value(period) == 0.0:  # a zero period has no ticks
            break
        noise = noise_of(fit.residuals, series, floor)
        try:
            now = minimise(fit.model, fit.run, fit.names, noise, fit.starts, 0, pool)
            late = fit.model.value(INPUT_DELAY) if INPUT_DELAY in fit.model.parameters else 0.0
            mean = {INPUT_DELAY: late + 0.5 * fit.model.value(period)} if INPUT_DELAY in fit.names else {}
            guesses = scanned(now.model.with_values(mean), series, now.starts, noise)
            cases, costs = tried(now, places, guesses, pool)
            moved = moved_to(now, places, cases[np.argmin(costs)])
            found = minimise(
                moved, now.run, now.names, noise, now.starts, 15, pool, differences=now.differences
            )
        except InputError:
            return fit
        if found.chi2 > NOTHING_NEW * now.chi2:
            return fit
        fit = found
    return fit


def places_of(fit: Fit) -> list[int]:
    """Indices of period and input delay among the free parameters."""
    return [fit.names.index(name) for name in (clock_of(fit.model), INPUT_DELAY) if name in fit.names]


def moved_to(fit: Fit, places: Sequence[int], case: Array) -> Model:
    return fit.model.with_values({fit.names[place]: float(value) for place, value in zip(places, case)})


def tried(
    fit: Fit, places: Sequence[int], guesses: Sequence[dict[str, float]], pool: ThreadPoolExecutor | None
) -> tuple[Array, Array]:
    """Cases (n, 1 or 2) of the period and the delay, around the fit and the guesses, with their chi2 (n,)."""
    cases = np.array([fit.values[places], *([one[fit.names[place]] for place in places] for one in guesses)])
    costs = _costs(fit, places, cases, pool)
    longest = max(one.time[-1] - one.time[0] for one in fit.run.series)
    sample = max(one.period for one in fit.run.series)
    reach, late = WIDE, sample
    while reach > FINE:
        grid = _grid(float(cases[0, 0]), longest, sample, reach, late)[:, : len(places)]
        near = cases[np.argsort(costs)[:FOLLOWED]]
        around = (near[:, None, :] + grid).reshape(-1, len(places))
        cases = np.concatenate([cases, np.maximum(around, 0.0)])
        costs = np.concatenate([costs, _costs(fit, places, cases[len(costs) :], pool)])
        reach, late = FINER * reach, max(FINER * late, LEAST_MOVE * sample)
    return cases, costs


def _grid(period: float, longest: float, sample: float, reach: float, late: float) -> Array:
    """Changes (n, 2) of period and delay [s] that move the last tick by up to `reach` periods.

    While ticks move by more than a sample, the mean delay matters, of which half a period is due to the hold. On a
    finer grid it matters which command a tick takes. A delay that moves like the ticks in the middle of the record
    leaves this unchanged.
    """
    steps = reach * period**2 / longest * STEPS
    if reach * period > sample:
        return np.array([(step, late * shift - 0.5 * step) for step in steps for shift in SHIFTS])
    middle = 0.5 * longest / period
    return np.array([(step, reach * period * shift + middle * step) for step in steps for shift in SHIFTS])


def _costs(fit: Fit, places: Sequence[int], cases: Array, pool: ThreadPoolExecutor | None) -> Array:
    """Chi2 (n,) of the cases with all other fitted parameters following linearly; infinite where the model diverges."""
    columns = np.delete(fit.linearisation.jacobian, places, axis=1)
    others, _ = np.linalg.qr(columns / column_norms(columns))
    outputs = fit.run.many([(moved_to(fit, places, case), fit.starts) for case in cases], pool)
    costs = np.full(len(cases), np.inf)
    for number, given in enumerate(outputs):
        if given is not None:
            rest = white_residual(fit, [o - one.averaged for o, one in zip(given, fit.run.series)])
            costs[number] = np.sum((rest - others @ (others.T @ rest)) ** 2)
    return costs


def white_residual(fit: Fit, residuals: Sequence[Array]) -> Array:
    """Whitened residuals, with the effect of initial states projected out."""
    problem = Problem(fit.run, fit.names, fit.noise, None)
    white = [problem.whitened(index, residual) for index, residual in enumerate(residuals)]
    return fit.linearisation.without_starts(white)
