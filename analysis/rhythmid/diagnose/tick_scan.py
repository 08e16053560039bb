"""Scan for the period of a drive's own clock: a parameter whose best value is too narrow for any descent to find.

After a time T an error dP of the period P has moved the ticks by T dP / P; once that is half a period the likelihood has
forgotten their phase. What a hold does to the size of the response it still knows, and that tells the rate 1/P roughly: a
coarse scan leaves a band of rates. They are tried on a grid of 1 / (4 T) over a first stretch, and the best of them
followed while the stretch grows to the whole record. The mean delay, of which half a period is the hold's, is kept;
what small changes of the other parameters and of the initial states do is projected off each residual.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.identify.free_run import FreeRun, prepare_run
from rhythmid.identify.multiple_shooting import split
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import minimise
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import Series, dominant_frequency
from rhythmid.model import Model

Array = NDArray[np.float64]
HOLD, PERIOD, DELAY = "command_hold", "command_hold.period", "input_delay.delay"
STRETCH = 16.0  # [s] of the first stretch, at most: shorter ones see little of the ticks' phase
COARSE = 50  # rates of the coarse scan
BAND = 0.5  # of the way from the best to the middling cost of the coarse scan, up to which a rate is in the band
MOST = 2000  # rates tried over the first stretch
SERIES = 2  # looked at, those with the strongest command at first
FASTEST = 100.0  # [Hz] beyond which a hold is little but a delay, and its ticks do not matter
FOLLOWED = 24  # rates that are followed
FOUND = 2  # guesses returned
FINEST = 0.002  # spacing of the rates at the end, over the inverse length of the record


def scanned(
    model: Model, series: Sequence[Series], starts: Sequence[Array], noise: NoiseModel, step: float
) -> list[dict[str, float]]:
    """First guesses of period and delay [s] of a model with a command hold, best first; empty where no rate is possible.

    `starts` are the initial states of the series; the other parameters stay at the model's values.
    """
    mean = model.parameters[DELAY].value if DELAY in model.parameters else 0.0
    driven = [(one, start) for one, start in zip(series, starts) if one.command is not None and one.kind == "force"]
    if mean <= 0.0 or not driven:
        return []
    slowest = max(0.45 / mean, 4.0 * max(dominant_frequency(one) for one, _ in driven))
    fastest = min(FASTEST, 0.5 / max(one.period for one, _ in driven))
    if slowest >= fastest:
        return []
    driven.sort(key=lambda case: -_strength(case[0]))
    chosen = [one for one, _ in driven[:SERIES]]
    begin = [start for _, start in driven[:SERIES]]
    longest = max(one.time[-1] - one.time[0] for one in chosen)

    def guess(rate: float) -> dict[str, float]:
        return {PERIOD: 1.0 / rate, DELAY: max(mean - 0.5 / rate, 0.0)}

    def costs(length: float, rates: Array, middle: float) -> Array:
        stretches = [split(one, length)[0] for one in chosen]
        run = prepare_run(model, stretches, step)
        return _costs(run, model.with_values(guess(middle)), [guess(float(rate)) for rate in rates], begin, noise)

    whole = 1.01 * longest
    rates = np.geomspace(slowest, fastest, COARSE)
    coarse = costs(whole, rates, float(np.sqrt(slowest * fastest)))
    if not np.isfinite(coarse).any():
        return []
    near = rates[coarse <= coarse.min() + BAND * (np.median(coarse) - coarse.min())]
    best = float(rates[np.argmin(coarse)])
    low, high = near.min() / 1.05, near.max() * 1.05
    length = min(STRETCH, whole, 0.25 * MOST / (high - low))
    spacing = 0.25 / length
    rates = np.arange(low, high, spacing)
    while True:
        found = rates[np.argsort(costs(length, rates, best))[:FOLLOWED]]
        best = float(found[0])
        if spacing < FINEST / longest:
            apart = [rate for rate in found[1:] if abs(rate - best) > 0.25 / longest]
            return [guess(float(rate)) for rate in (best, *apart)[:FOUND]]
        length = min(2.0 * length, whole)
        spacing *= 0.5
        rates = np.unique(np.round((found[:, None] + spacing * np.arange(-2, 3)).ravel(), 9))


def _strength(series: Series) -> float:
    assert series.command is not None
    return float(np.std(series.command(series.centres)))


def _costs(
    run: FreeRun, middle: Model, guesses: Sequence[dict[str, float]], starts: Sequence[Array], noise: NoiseModel
) -> Array:
    """Whitened sums of squares that the guesses leave, beyond what the model's other parameters can do at `middle`."""
    names = tuple(name for name in middle.free if name != PERIOD)
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
        joined = np.concatenate([w - b @ (b.T @ w) for w, b in zip(white, linearisation.bases)])
        costs[number] = float(joined @ joined) - float(np.sum((left.T @ joined) ** 2))
    return costs
