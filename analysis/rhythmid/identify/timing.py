"""Timing as it is on robots: clocks that drift apart, delays that drift, jitter, commands held at a slower rate.

Drifts and holds bias the delays, so they are looked for after every fit, and where one shows it becomes part of the
model. Jitter hardly biases anything: it is read off what the fit leaves. Lost samples and unequal rates need nothing of
this: simulation and measurement are compared at the stamps that there are.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.identification import Estimate
from rhythmid.identify.joint import JointFit
from rhythmid.identify.output_error import Fit, estimate, minimise
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import Series, scales

Array = NDArray[np.float64]
DRIFTS = ("clock_skew", "input_delay_drift")
DRIFT_PARAMETER = {"clock_skew": "skew", "input_delay_drift": "rate"}
ALIKE = {"clock_skew": ("delay_drift",)}  # the same to first order
CERTAIN = 5.0  # standard deviations from which a timing effect becomes part of the model
SMEARS = 3  # widths of command jitter that are tried
UNEXPLAINED = 1.5  # times the noise floor, beyond which a hold is looked for
GAIN = 25.0  # in chi2 that a hold must bring


def drift_score(fit: Fit, element: str) -> tuple[float, float]:
    """One-step estimate of a drift and its standard deviation, everything else refitted along (a score test).

    C. R. Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50.
    """
    model = fit.model.with_element(load_catalogue()[element], {DRIFT_PARAMETER[element]: 0.0})
    name = next(n for n in model.parameters if n not in fit.model.parameters)
    run = prepare_run(model, fit.run.series, fit.run.max_step)
    problem = Problem(run, (name,), fit.noise, None)
    problem.learn_hidden(model, fit.starts)
    longest = max(one.time[-1] for one in run.series)
    step = 1e-2 * run.series[0].period / longest
    base = run.outputs(model, fit.starts)
    moved = run.outputs(model.with_values({name: step}), fit.starts)
    if base is None or moved is None:
        return 0.0, math.inf
    columns = []
    for index, (a, b) in enumerate(zip(base, moved)):
        white = problem.whitened(index, (b - a) / step)
        basis = fit.linearisation.bases[index]
        columns.append(white - basis @ (basis.T @ white))
    column = np.concatenate(columns)
    others = fit.linearisation.jacobian
    scaled = others / np.maximum(np.linalg.norm(others, axis=0), 1e-150)
    own = column - scaled @ np.linalg.lstsq(scaled, column, rcond=1e-10)[0]
    square = float(own @ own)
    if square < 1e-12 * float(column @ column) or square == 0.0:
        return 0.0, math.inf
    return -float(own @ fit.linearisation.residual) / square, 1.0 / math.sqrt(square)


def compensated(joint: JointFit, pool: ThreadPoolExecutor | None = None) -> tuple[JointFit, tuple[str, ...]]:
    """The fit with every drift of clock or delay that shows made part of the model, or a command held at a slower rate;
    and what was found, in words."""
    fit, notes = joint.fit, []
    catalogue = load_catalogue()
    for _ in DRIFTS:
        scores = {
            name: drift_score(fit, name)
            for name in DRIFTS
            if not any(t.element.name in (name, *ALIKE.get(name, ())) for t in fit.model.terms)
            and (name != "input_delay_drift" or fit.model.term("input_delay") is not None)
        }
        shown = {name: value / std for name, (value, std) in scores.items() if abs(value) > CERTAIN * std}
        if not shown:
            break
        name = max(shown, key=lambda n: abs(shown[n]))
        before = fit
        extended = fit.model.with_element(catalogue[name], {DRIFT_PARAMETER[name]: scores[name][0]})
        fit = estimate(extended, fit.run.series, pool=pool, max_step=fit.run.max_step)
        parameter = f"{name}.{DRIFT_PARAMETER[name]}"
        value, std = fit.model.value(parameter), fit.std[parameter]
        small = abs(value) * max(float(np.ptp(one.time)) for one in fit.run.series) < 1e-6
        if abs(value) < CERTAIN * std or small or fit.noise.variance > before.noise.variance:
            fit = before
            break
        told = "the clocks of measurement and command run apart, or the measurement delay drifts"
        if name == "input_delay_drift":
            told = "the input delay drifts"
        notes.append(
            f"{told}: {1e6 * value:+.3f} ± {1e6 * std:.3f} µs/s; part of the model, and the delays are those at the "
            "record's zero"
        )
    found = replace(joint, fit=fit)
    if joint.search.over_noise > UNEXPLAINED and fit is joint.fit and fit.model.term("input_delay") is not None:
        found, period = command_hold(found, pool)
        if period > 0.0:
            notes.append(f"the drive takes a new command every {1e3 * period:.3g} ms only; part of the model")
    return found, tuple(notes)


def _simulated(fit: Fit, index: int) -> tuple[Array, Array]:
    """Noise-free output and its rate at every sample of series `index`, (n,) each."""
    one = fit.run.series[index]
    rows = fit.run.rows(fit.model, index, fit.starts[index])
    if rows is None:
        raise InputError("the model diverges")
    through = CubicSpline(one.centres, rows[:, fit.run.states])
    time = one.time[: one.blocks * one.block]
    return through(time), through(time, 1)


def measurement_jitter(fit: Fit) -> Estimate:
    """Standard deviation σ [s] of the age of single measurements, from residuals that grow with speed.

    Residual variance is σ_n² + σ² v²: a weighted straight line in v² (T. M. Souders et al., IEEE TIM 39(1), 1990). The
    mean of the jitter is part of the measurement delay.
    """
    square, speed = [], []
    for index, one in enumerate(fit.run.series):
        output, rate = _simulated(fit, index)
        edge = 2 * one.block
        inside = np.repeat(one.used, one.block)
        inside[:edge] = inside[-edge:] = False
        left = one.value[: len(output)] - output
        square.append(left[inside] ** 2)
        speed.append(rate[inside] ** 2)
    y, x = np.concatenate(square), np.concatenate(speed)
    columns = np.column_stack([np.ones(len(x)), x / max(float(x.mean()), 1e-300)])
    weight = np.full(len(x), 1.0)
    solution = np.zeros(2)
    for _ in range(4):
        solution = np.linalg.lstsq(columns * weight[:, None], y * weight, rcond=1e-12)[0]
        expected = np.maximum(columns @ np.maximum(solution, 0.0), 0.05 * float(y.mean()) + 1e-300)
        weight = 1.0 / expected
    scatter = columns * weight[:, None]
    left = (y - columns @ solution) * weight
    covariance = np.linalg.pinv(scatter.T @ scatter) * float(np.mean(left**2))
    variance = float(solution[1]) / float(x.mean())
    spread = math.sqrt(covariance[1, 1]) / float(x.mean())
    std = math.sqrt(max(variance, 0.0))
    return Estimate(std, spread / (2.0 * max(std, math.sqrt(spread))), "s")


def _refitted(fit: Fit, series: Sequence[Series], pool: ThreadPoolExecutor | None) -> Fit:
    run = prepare_run(fit.model, series, fit.run.max_step)
    return minimise(fit.model, run, fit.names, fit.noise, fit.starts, 10, pool)


def smeared(command: PPoly, width: float, period: float) -> PPoly:
    """The mean of a held command over delays uniform on [0, width]: (U(t) − U(t − width)) / width, U its integral."""
    if width <= 0.0:
        return command
    knots, values = command.x[:-1], command.c[-1]
    integral = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(knots))])

    def whole(at: Array) -> Array:
        inside = np.interp(at, knots, integral, left=0.0)
        late = at > knots[-1]
        inside[late] = integral[-1] + values[-1] * (at[late] - knots[-1])
        return inside

    time = np.arange(knots[0], knots[-1] + width, 0.5 * period)
    fitted = CubicSpline(time, (whole(time) - whole(time - width)) / width)
    return PPoly(fitted.c, fitted.x, extrapolate=True)


def command_jitter(fit: Fit, largest: float = 0.05, pool: ThreadPoolExecutor | None = None) -> Estimate:
    """Standard deviation σ [s] of the delay of single commands, from the roll-off of the response.

    On average over the jitter the machine receives the command smeared over √12 σ. The profile likelihood over σ² is a
    parabola, which gives estimate and standard deviation; the mean of the jitter is part of the input delay.
    """
    step = fit.run.series[0].period
    at = np.linspace(0.0, largest, SMEARS + 1) ** 2
    for _ in range(3):
        chi2 = []
        for variance in at:
            width = math.sqrt(12.0 * variance)
            series = [
                one if one.command is None else replace(one, command=smeared(one.command, width, step))
                for one in fit.run.series
            ]
            start = fit.model.value("input_delay.delay") - 0.5 * width
            moved = replace(fit, model=fit.model.with_values({"input_delay.delay": start}))
            chi2.append(_refitted(moved, series, pool).chi2)
        curve = np.polyfit(at / at[-1], chi2, 2)
        if curve[0] <= 0.0:
            return Estimate(None, None, "s")
        best = float(np.clip(-0.5 * curve[1] / curve[0], 0.0, 1.0)) * at[-1]
        spread = at[-1] / math.sqrt(curve[0])
        reach = max(2.0 * best, 6.0 * spread)
        if reach > 0.5 * at[-1]:
            break
        at = np.linspace(0.0, reach, SMEARS + 1)
    std = math.sqrt(best)
    return Estimate(std, spread / (2.0 * max(std, math.sqrt(spread))), "s")


def command_hold(
    joint: JointFit, pool: ThreadPoolExecutor | None = None, tell: Callable[[str], None] = lambda _: None
) -> tuple[JointFit, float]:
    """Look for a drive that takes commands at a slower rate of its own; the fit with it and its period [s], or 0.

    Ticks of the usual rates are tried, each with the delays refitted; the best must lower chi2 by more than 25.
    """
    fit = joint.fit
    element = load_catalogue()["command_hold"]
    best, period = fit, 0.0
    if element.starts is None or fit.model.term("command_hold") is not None:
        return joint, period
    for values in element.starts(scales(fit.run.series, fit.model)):
        model = fit.model.with_element(element, values, fixed=True)
        half = 0.5 * values["period"]
        model = model.with_values({"input_delay.delay": max(model.value("input_delay.delay") - half, 0.0)})
        tell(f"a command held for {1e3 * values['period']:.3g} ms?")
        run = prepare_run(model, fit.run.series, fit.run.max_step)
        try:
            trial = minimise(model, run, fit.names, fit.noise, fit.starts, 8, pool)
        except InputError:
            continue
        if trial.chi2 < best.chi2 - (GAIN if best is fit else 0.0):
            best, period = trial, values["period"]
    return replace(joint, fit=best), period
