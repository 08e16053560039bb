"""Timing errors of robots: clock drift, delay drift, jitter, commands held at a slower rate.

Drifts and holds bias the delays. So they are tested after every fit, and a significant one becomes part of the
model. Jitter causes hardly any bias; it is estimated from the residuals. Lost samples and unequal rates need no
correction, because simulation and measurement are compared at the actual timestamps.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.free_run import FreeRun, prepare_run
from rhythmid.identify.identification import Estimate
from rhythmid.identify.joint import JointFit
from rhythmid.identify.output_error import Fit, estimate, minimise
from rhythmid.identify.record_scales import scales
from rhythmid.identify.robust_covariance import with_robust_covariance
from rhythmid.identify.sample_clock.clock import clock_of
from rhythmid.identify.sensitivity import Problem
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
DRIFTS = ("clock_skew", "input_delay_drift")
EVIDENT_BY = 5.0  # standard deviations above which a timing effect becomes part of the model
SMEARS = 3  # number of widths of command jitter that are tried
ROLL_OFF_SAMPLES = 1_000_000  # samples that are enough to estimate a roll-off: further records are not used
# least expected square of each residual, as a share of their mean square: no single sample decides
LEAST_VARIANCE = 0.05
TINY = 1e-300  # replaces a mean square of zero
# variance of squared speed (of mean one) that is rounding error: for a real motion it is one or more
EVEN_SPEED = 1e-12
UNEXPLAINED = 1.5  # ratio to the noise floor above which a hold is searched
HOLD_GAIN = 25.0  # least decrease of chi2 by a hold
# least period of a hold, in sample periods, that can be distinguished from the commands' own hold
SLOWER = 3.0
LONGEST_HOLD = 0.25  # [s] longest interval between two commands that the drive takes
REACH = 0.05  # least share of a rough period searched on either side of it
FINEST = 200  # largest number of periods tried there
REFITTED = 5  # number of the best of them that are refitted


def drift_score(fit: Fit, element: str) -> tuple[float, float]:
    """One-step estimate of a drift and its standard deviation, with all other parameters refitted (a score test).

    C. R. Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50.
    """
    drift = load_catalogue()[element]
    model = fit.model.with_element(drift, {drift.size: 0.0})
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


def _possible_drifts(series: Sequence[Series]) -> tuple[str, ...]:
    """Drifts that the records could show. There is none without excitation, where the machine's own pace is the
    only one, and no clock drift between channels of one clock."""
    if not any(one.driven for one in series):
        return ()
    return tuple(name for name in DRIFTS if name != "clock_skew" or not any(one.one_clock for one in series))


def compensated(joint: JointFit, pool: ThreadPoolExecutor | None = None) -> tuple[JointFit, tuple[str, ...]]:
    """The fit with every significant drift of clock or delay, or a hold at a slower rate, as part of the model; and
    messages about them."""
    fit, notes = joint.fit, []
    catalogue = load_catalogue()
    possible = _possible_drifts(fit.run.series)
    for _ in possible:
        scores = {
            name: drift_score(fit, name)
            for name in possible
            if not any(t.element.name in (name, *catalogue[name].same_as) for t in fit.model.terms)
            and (name != "input_delay_drift" or fit.model.term("input_delay") is not None)
        }
        shown = {name: value / std for name, (value, std) in scores.items() if abs(value) > EVIDENT_BY * std}
        if not shown:
            break
        name = max(shown, key=lambda n: abs(shown[n]))
        before = fit
        extended = fit.model.with_element(catalogue[name], {catalogue[name].size: scores[name][0]})
        fit = estimate(extended, fit.run.series, pool=pool, max_step=fit.run.max_step)
        parameter = f"{name}.{catalogue[name].size}"
        # with standard deviations confirmed by the blocks' scores: missing effects shift a drift more than noise does
        value, std = fit.model.value(parameter), with_robust_covariance(fit).std[parameter]
        small = abs(value) * max(float(np.ptp(one.time)) for one in fit.run.series) < 1e-6
        if abs(value) < EVIDENT_BY * std or small or fit.noise.variance > before.noise.variance:
            fit = before
            break
        told = "the clocks of measurement and command run apart, or the measurement delay drifts"
        if name == "input_delay_drift":
            told = "the input delay drifts"
        notes.append(
            f"{told}: {1e6 * value:+.3f} ± {1e6 * std:.3f} µs/s; it is part of the model, and the delays are those at "
            "the start of the record"
        )
    found = replace(joint, fit=fit)
    if (
        joint.search.over_noise > UNEXPLAINED
        and fit is joint.fit
        and fit.model.term("input_delay") is not None
    ):
        found, period = command_hold(found, pool)
        if period.value is not None and period.std is not None:
            notes.append(
                f"the command acts as if the drive took a new one every {1e3 * period.value:.4g} ± {1e3 * period.std:.2g} "
                "ms only; the input delay does not contain half of that"
            )
    return found, tuple(notes)


def _simulated(fit: Fit, index: int) -> tuple[Array, Array]:
    """Noise-free output (n,) and its rate (n,) at every sample of series `index`."""
    one = fit.run.series[index]
    rows = fit.run.rows(fit.model, index, fit.starts[index])
    if rows is None:
        raise InputError("the model diverges")
    through = CubicSpline(one.centres, rows[:, fit.run.states])
    time = one.time[: one.blocks * one.block]
    return through(time), through(time, 1)


def measurement_jitter(fit: Fit) -> Estimate:
    """Standard deviation σ [s] of the jitter of single measurements, from residuals that grow with speed.

    Residual variance is σ_n² + σ² v²: a weighted straight line in v² (T. M. Souders et al., IEEE TIM 39(1), 1990). The
    mean of the jitter is part of the measurement delay. With constant speed the line is not determined.
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
    del square, speed  # a long recording leaves no room for a second copy
    per_speed, size = max(float(x.mean()), TINY), max(float(y.mean()), TINY)
    x /= per_speed
    y /= size
    if float(x.var()) < EVEN_SPEED:
        return Estimate(None, None, "s")
    solution, weight = np.zeros(2), np.ones(len(x))
    inverse = np.eye(2)
    for again in range(4):
        if again:
            weight = np.maximum(solution[0], 0.0) + np.maximum(solution[1], 0.0) * x
            weight = np.maximum(weight, LEAST_VARIANCE, out=weight) ** -2.0
        sums = weight.sum(), weight @ x, np.einsum("i,i,i", weight, x, x)
        inverse = np.linalg.pinv(np.array([sums[:2], sums[1:]]), hermitian=True)
        solution = inverse @ np.array([weight @ y, np.einsum("i,i,i", weight, x, y)])
    y -= solution[0] + solution[1] * x
    covariance = inverse * float(np.einsum("i,i,i", weight, y, y)) / len(y)
    variance = float(solution[1]) * size / per_speed
    spread = math.sqrt(covariance[1, 1]) * size / per_speed
    std = math.sqrt(max(variance, 0.0))
    return Estimate(std, spread / (2.0 * max(std, math.sqrt(spread), TINY)), "s")


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


def _received(fit: Fit, width: float) -> tuple[Fit, list[Series]]:
    """The fit with a delay shorter by half of `width` [s], and its series with commands averaged over `width`."""
    step = fit.run.series[0].period
    series = [
        one if one.command is None else replace(one, command=smeared(one.command, width, step))
        for one in fit.run.series
    ]
    start = fit.model.value(INPUT_DELAY) - 0.5 * width
    return replace(fit, model=fit.model.with_values({INPUT_DELAY: start})), series


def _first_samples(fit: Fit, enough: int) -> Fit:
    """The fit for its first series, with at least `enough` samples; all of it where there are fewer."""
    ends = np.cumsum([len(one.time) for one in fit.run.series])
    count = int(np.searchsorted(ends, enough)) + 1
    if count >= len(ends):
        return fit
    run = replace(fit.run, series=fit.run.series[:count])
    return replace(fit, run=run, starts=fit.starts[:count], residuals=fit.residuals[:count])


def _smear(fit: Fit, largest: float, pool: ThreadPoolExecutor | None) -> tuple[float, float] | None:
    """Variance [s²] of a delay that is uniform over an interval and so smooths the command; and its standard deviation.

    The profile likelihood over the variance is approximated by a parabola. None where the response does not roll off.
    """
    fit = _first_samples(fit, ROLL_OFF_SAMPLES)
    at = np.linspace(0.0, largest, SMEARS + 1) ** 2
    best = spread = 0.0
    for _ in range(3):
        chi2 = [_refitted(*_received(fit, math.sqrt(12.0 * variance)), pool).chi2 for variance in at]
        curve = np.polyfit(at / at[-1], chi2, 2)
        if curve[0] <= 0.0:
            return None
        best = float(np.clip(-0.5 * curve[1] / curve[0], 0.0, 1.0)) * at[-1]
        spread = at[-1] / math.sqrt(curve[0])
        reach = max(2.0 * best, 6.0 * spread)
        if reach > 0.5 * at[-1]:
            break
        at = np.linspace(0.0, reach, SMEARS + 1)
    return best, spread


def _widened(fit: Fit, name: str, std: float) -> Fit:
    """The fit with a further independent error of `name` added to its covariance."""
    index = fit.names.index(name)
    covariance = fit.covariance.copy()
    if not math.isfinite(covariance[index, index]):
        covariance[index], covariance[:, index] = 0.0, 0.0
    covariance[index, index] += std**2
    return replace(fit, covariance=covariance)


def command_hold(joint: JointFit, pool: ThreadPoolExecutor | None = None) -> tuple[JointFit, Estimate]:
    """Search for a drive that takes commands at a slower rate of its own: the fit with it, and its period P [s] or None.

    Averaged over the ticks, the drive smooths a held command over P. The roll-off determines P, and half of P is
    delay of the hold. Where the machine responds to single ticks, only a period that stays in step over the whole
    record fits (an element with an independent clock). Such periods are tried on a sufficiently fine grid, the
    usual rates included. Each step must lower chi2 by more than 25.
    """
    fit, name = joint.fit, INPUT_DELAY
    none = Estimate(None, None, "s")
    element = next((one for one in load_catalogue().values() if one.clock and one.slot == "command"), None)
    smear = None
    if clock_of(fit.model) is None and name in fit.names:
        smear = _smear(fit, LONGEST_HOLD / math.sqrt(12.0), pool)
    step = fit.run.series[0].period
    if element is None or smear is None or smear[0] < EVIDENT_BY * smear[1]:
        return joint, none
    rough = math.sqrt(12.0 * smear[0])
    if rough < SLOWER * step:
        return joint, none
    spread = 6.0 * smear[1] / rough
    best, period = _refitted(*_received(fit, rough), pool), Estimate(rough, spread, "s")
    width = rough
    early = best.model.value(name) < -step  # a roll-off without a delay is no hold
    if best.chi2 > fit.chi2 - HOLD_GAIN or early:
        return joint, none
    own = step / math.sqrt(12.0)  # a tick does not show the age of a command that is itself held
    best = _widened(best, name, math.hypot(0.5 * spread, own))

    share = min(max(REACH, 3.0 * spread / rough), 0.5)
    usual = [values[element.clock] for values in element.first_guesses(scales(fit.run.series, fit.model))]
    longest = max(float(np.ptp(one.time)) for one in fit.run.series)
    count = int(np.clip(4.0 * share * longest / rough, 8, FINEST))
    tried = {*rough * np.linspace(1.0 - share, 1.0 + share, count + 1)}
    tried |= {p for p in usual if abs(p - rough) < 2.0 * share * rough}

    def held(ticks: float) -> tuple[Model, FreeRun]:
        model = fit.model.with_element(element, {element.clock: ticks}, fixed=True)
        model = model.with_values({name: max(model.value(name) - 0.5 * ticks, 0.0)})
        return model, prepare_run(model, fit.run.series, fit.run.max_step)

    def unrefined(ticks: float) -> float:
        model, run = held(ticks)
        problem = Problem(run, fit.names, fit.noise, None)
        problem.learn_hidden(model, fit.starts)
        return problem.cost(model, problem.residuals(model, fit.starts), fit.starts)

    gain = HOLD_GAIN
    for ticks in sorted(tried, key=unrefined)[:REFITTED]:
        model, run = held(ticks)
        try:
            trial = minimise(model, run, fit.names, fit.noise, fit.starts, 8, pool)
        except InputError:
            continue
        if trial.chi2 < best.chi2 - gain:
            best, gain, width = _widened(trial, name, own), 0.0, 0.0
            period = Estimate(ticks, ticks**2 / longest, "s")
    return replace(joint, fit=best, smear=width), period
