"""Detects channels in another unit or sign, or input and output exchanged, by comparison with the nominal model.

Natural frequency and damping ratio do not depend on the scale of a channel; gains do. So every channel of a short
stretch is changed in the ways in which a user may have declared it wrongly, and the model is refitted to each. A
change is accepted where it explains what the record as declared does not. A free inertia can absorb a scale, so
that no error remains. Then the values tell: all are shifted, and return to the given ones under the right change.

Effects that the model lacks shift values, too. At one amplitude and speed dry friction acts like more damping.
Where only the damping is identifiable, it acts like more of everything. A mass on a spring moves, below its
resonance, with the opposite sign from the mass without the spring. So before a change is accepted, the record as
declared is fitted with dry friction, a constant force and a spring added to the model. They cannot absorb a wrong
scale, because they do not accelerate a mass.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.channel_change import Change, guess, instruction, likely_changes
from rhythmid.identify.declared import own_model, with_declared
from rhythmid.identify.descent import WHITE
from rhythmid.identify.free_run import with_series
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.joint import prepared_model
from rhythmid.identify.other_starts import from_windows
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.search_quality import POOR_MOTION, Search, explained
from rhythmid.identify.series import Series, dominant_frequency, prepare
from rhythmid.model import INERTIA, Model
from rhythmid.record.record import Record
from rhythmid.report.quantity import number

STRETCH = 15.0  # periods that are used: enough for a resonance of 2 % damping to ring down
SHORT = 4.0  # periods where a search may fail over a longer stretch, such as in large oscillations
ITERATIONS = 12  # iterations of each refit: the right change converges in fewer
# largest ratio of the unexplained share with a change to that as declared; it must also be below `POOR_MOTION`
BETTER_UNIT = 0.4
# records that are tried until one is conclusive: an aperiodic motion, such as that of a whirling pendulum, is not
TRIED = 3
SHIFTED, BACK = (
    math.log(4.0),
    math.log(2.0),
)  # mean |log| ratio of the values to the given ones, as declared and with the change
EQUAL, SAME = 1.2, 0.01  # ratio of errors, and difference of errors, within which two changes are equivalent
# factor below which a gain is an effect (a gain element, a wrong nominal value) and not a unit
LEAST_UNIT_FACTOR = 4.0
STEP = 0.01  # relative step for the derivative with respect to a gain
TRANSITION = 0.1  # share of the usual speed over which the sign of the added friction changes at first
# starting values of the search for the scale of an input in an unknown unit
GAINS = (0.01, 0.03, 0.1, 10.0, 30.0, 100.0)


AS_DECLARED = Change("output")


@dataclass(frozen=True)
class Trial:
    """A change, the share of the motion that stays `unexplained` after the refit, and the `shift` of the model's
    values: the mean
    |log| of their ratio to the given ones."""

    change: Change
    unexplained: float
    shift: float
    fit: Fit | None = None


@dataclass(frozen=True)
class Mend:
    """An accepted change, in words. `certain` where the record as declared cannot be explained; otherwise only the
    shift of the values supports it."""

    change: Change
    text: str
    certain: bool


def check_plausible(
    model: Model, records: Sequence[Record], pool: ThreadPoolExecutor | None = None
) -> str | None:
    """A warning where the shift of the values suggests another unit of a channel.

    Raises InputError with the likely correction where the records as declared cannot be explained, and another unit
    or sign of a channel, or an exchange of input and output, fits the model.
    """
    mend = likely_mend(model, records, pool)
    if mend is not None and mend.certain:
        raise InputError(mend.text)
    return None if mend is None else mend.text


def likely_mend(
    model: Model, records: Sequence[Record], pool: ThreadPoolExecutor | None = None
) -> Mend | None:
    """The change of a channel under which the model explains the records or keeps its values; None where they are
    plausible."""
    model = with_declared(model, records)
    driven = [one for one in records if one.input is not None] or list(records)
    for record in sorted(driven, key=lambda one: -float(np.std(one.output.value)))[:TRIED]:
        tried = partial(_tried, record=record, model=own_model(model, record), pool=pool)
        declared = _declared(record, own_model(model, record), pool)
        if declared.unexplained < POOR_MOTION:
            return _shift(record, declared, model, tried, pool) if declared.shift > SHIFTED else None
        mend = _misfit(record, declared, model, tried, pool)
        if mend is not None:
            return mend
    return None


def _misfit(
    record: Record,
    declared: Trial,
    model: Model,
    tried: partial[Trial | None],
    pool: ThreadPoolExecutor | None,
) -> Mend | None:
    """The change that explains what the record as declared does not."""
    trials = [one for change in likely_changes(record, model) if (one := tried(change)) is not None]
    best = min(trials, key=lambda one: one.unexplained, default=declared)
    if not _convinces(best, declared) or best.change.role == "input":
        foreign = _foreign(tried)
        if foreign is not None and _convinces(foreign, best):
            best, trials = foreign, [foreign]
    if not _convinces(best, declared):
        return None
    again = _searched_again(best, record, model, pool)
    if again is not None:  # the search had failed, or an effect is missing
        return _shift(record, again, model, tried, pool) if again.shift > SHIFTED else None
    alike = [one for one in trials if one.unexplained <= EQUAL * best.unexplained + SAME]
    return Mend(alike[0].change, _words(record, model, declared, alike), True)


def _searched_again(
    best: Trial, record: Record, model: Model, pool: ThreadPoolExecutor | None
) -> Trial | None:
    """Second fit of the record as declared, before a change is accepted. It starts from the values found with the
    change, with and without its factor in the values to which a force is proportional, and also uses a shorter
    stretch, and the values and initial states of short windows."""
    if best.fit is None:
        return None
    found = {n: best.fit.model.value(n) for n in model.free}
    factor = 1.0
    if best.change.role in ("input", "output"):
        factor = abs(best.change.factor) if best.change.role == "output" else 1.0 / abs(best.change.factor)
    rescaled = found | {n: factor * found[n] for n in gains(model)}
    known = model.parameters
    for values, periods in ((rescaled, STRETCH), (found, STRETCH), ({}, SHORT), (found, SHORT)):
        within = {n: float(np.clip(v, *known[n].bounds)) for n, v in values.items()}
        again = _tried(AS_DECLARED, record, model.with_values(within), pool, model, periods)
        if again is not None and again.unexplained < POOR_MOTION:
            return again
    again = _tried(AS_DECLARED, record, model, pool, in_windows=True)
    if again is not None and again.unexplained < POOR_MOTION:
        return again
    richer = _with_more(record, model, pool)
    return richer if richer is not None and richer.unexplained < POOR_MOTION else None


def _convinces(trial: Trial, declared: Trial) -> bool:
    return trial.unexplained < min(POOR_MOTION, BETTER_UNIT * declared.unexplained)


def _shift(
    record: Record,
    declared: Trial,
    model: Model,
    tried: partial[Trial | None],
    pool: ThreadPoolExecutor | None,
) -> Mend | None:
    """The change that returns all values to the given ones, where they are shifted as declared, the error does not
    grow, and no missing effect does the same."""
    trials = [one for change in likely_changes(record, model) if (one := tried(change)) is not None]
    back = _back(trials, declared)
    if not back:  # no named unit, such as amperes
        common = _common_factor(declared.fit, model)
        one = None if common is None else tried(Change("input", 1.0 / common))
        back = [] if one is None else _back([one], declared)
    if not back:
        return None
    richer = _with_more(record, model, pool)
    if richer is not None and _back([richer], declared):
        return None
    best = min(one.shift for one in back)
    alike = [one for one in back if one.shift <= best + 0.1 * BACK]
    return Mend(alike[0].change, _words(record, model, declared, alike), False)


def _back(trials: Sequence[Trial], declared: Trial) -> list[Trial]:
    """Trials that return the values to the given ones and explain the record as well."""
    most = EQUAL * declared.unexplained + SAME
    return [one for one in trials if one.shift < BACK and one.unexplained <= most]


def _with_more(record: Record, model: Model, pool: ThreadPoolExecutor | None) -> Trial | None:
    """The record as declared, fitted by the model with added dry friction, constant force and spring. None where
    the model has them already, or where the effort along the motion does not give their approximate size."""
    own = own_model(model, record)
    try:
        balance = Balance.of([record], own)
    except InputError:
        return None
    position, speed = balance.mechanical[:, 0], balance.mechanical[:, 1]
    missing = balance.measured - balance.predicted(own)
    columns = np.column_stack([np.sign(speed), np.ones(len(speed)), position])
    friction, offset, stiffness = np.linalg.lstsq(columns, missing)[0]
    tried = {
        "coulomb_friction": {"force": friction, "transition": TRANSITION * float(np.median(np.abs(speed)))},
        "constant_force": {"force": offset},
        "linear_spring": {"stiffness": stiffness, "rest_length": 0.0},
    }
    rich, catalogue = own, load_catalogue()
    for name, values in tried.items():
        if own.term(name) is None:
            bounds = {one.name: one.bounds for one in catalogue[name].parameters}
            inside = {key: float(np.clip(value, *bounds[key])) for key, value in values.items()}
            rich = rich.with_element(catalogue[name], inside)
    return None if rich is own else _tried(AS_DECLARED, record, rich, pool, model)


def _common_factor(fit: Fit | None, given: Model) -> float | None:
    """The common factor of all values to which a force is proportional; None where they have none, or are fewer
    than two, because a single wrong value is not a unit."""
    if fit is None:
        return None
    logs = [
        math.log(fit.model.value(n) / given.value(n))
        for n in gains(given)
        if fit.model.value(n) / given.value(n) > 0.0
    ]
    if len(logs) < 2 or np.ptp(logs) > BACK:
        return None
    return math.exp(float(np.mean(logs)))


def gains(model: Model) -> list[str]:
    """Free nonzero parameters in units of force: all of them scale with the force's unit."""
    force = model.units.force
    return [
        n
        for n in model.free
        if model.value(n) != 0.0 and (n == INERTIA or model.parameters[n].unit.startswith(force))
    ]


def _foreign(tried: partial[Trial | None]) -> Trial | None:
    """The input with the gain that fits the model best, such as amperes for N m, where it is far from 1."""
    found = [
        one
        for gain in GAINS
        for sign in (1.0, -1.0)
        if (one := tried(Change("input", sign * gain))) is not None
    ]
    best = min(found, key=lambda one: one.unexplained, default=None)
    for _ in range(3):
        if best is None or best.fit is None:
            return None
        better = tried(Change("input", best.change.factor * (1.0 + _gain_step(best.fit))))
        if better is None or better.unexplained >= best.unexplained:
            break
        best = better
    if best is None or 1.0 / LEAST_UNIT_FACTOR < abs(best.change.factor) < LEAST_UNIT_FACTOR:
        return None
    return best


def _gain_step(fit: Fit) -> float:
    """Relative change of the input that the residual calls for with the model's values fixed: one least-squares step."""
    run = fit.run
    one = run.series[0]
    assert one.command is not None
    louder = with_series(
        run, 0, replace(one, command=type(one.command)((1.0 + STEP) * one.command.c, one.command.x))
    )
    base, more = (
        with_series(run, 0, one).outputs(fit.model, fit.starts),
        louder.outputs(fit.model, fit.starts),
    )
    if base is None or more is None:
        return 0.0
    slope = (more[0] - base[0])[one.used] / STEP
    return float(np.clip(-(slope @ fit.residuals[0][one.used]) / max(slope @ slope, 1e-300), -0.9, 9.0))


def _declared(record: Record, model: Model, pool: ThreadPoolExecutor | None) -> Trial:
    """The record as declared, fitted from several delays: a late start of the response must not look like a changed
    sign."""
    best = _tried(AS_DECLARED, record, model, pool) or Trial(AS_DECLARED, math.inf, 0.0)
    label = "input_delay.delay"
    if best.unexplained < POOR_MOTION or best.fit is None or label not in best.fit.names:
        return best
    period = 1.0 / dominant_frequency(best.fit.run.series[0])
    for share in (0.25, 0.5):
        assert best.fit is not None
        late = best.fit.model.with_values({label: share * period})
        other = _tried(AS_DECLARED, record, late, pool, model)
        if other is not None and other.unexplained < best.unexplained:
            best = other
    return best


def _tried(
    change: Change,
    record: Record,
    model: Model,
    pool: ThreadPoolExecutor | None,
    given: Model | None = None,
    periods: float = STRETCH,
    in_windows: bool = False,
) -> Trial | None:
    """The model refitted to a stretch of the record under a change; None where it cannot be simulated."""
    changed = change.applied(record)
    if changed is None:
        return None
    try:
        ready, pumping = prepared_model(model, [changed])
        one = _stretch(prepare([changed])[0], periods)
        noise = replace(WHITE, std=1e-2 * max(float(np.std(one.averaged)), 1e-300))
        if in_windows:
            fit = from_windows(ready, [one], pool)
        else:
            fit = estimate(ready, [one], noise=noise, pool=pool, iterations=ITERATIONS)
        return Trial(change, unexplained(explained(fit, pumping)), shift(given or model, fit.model), fit)
    except InputError:
        return None


def unexplained(search: Search) -> float:
    """Unexplained share of the motion, or of the response to the command where that exceeds the noise."""
    return search.motion if search.over_noise < 2.0 else max(search.motion, search.response)


def shift(given: Model, fitted: Model) -> float:
    """Mean |log| of the ratios of a model's free values to the given ones, each limited to a factor of a million."""
    ratios = []
    for name in given.free:
        value = given.parameters[name]
        if value.value == 0.0 or value.unit in ("s", "Hz"):
            continue
        ratio = abs(fitted.value(name) / value.value)
        ratios.append(min(abs(math.log(max(ratio, 1e-300))), math.log(1e6)))
    return float(np.mean(ratios)) if ratios else 0.0


def _stretch(series: Series, periods: float) -> Series:
    """The first `periods` periods of a series."""
    count = int(periods / (dominant_frequency(series) * series.period * series.block)) + 1
    count = min(count, series.blocks)
    samples = count * series.block
    return replace(series, time=series.time[:samples], value=series.value[:samples], used=series.used[:count])


def _words(record: Record, model: Model, declared: Trial, alike: Sequence[Trial]) -> str:
    """The likely wrong declaration and its correction, in one line."""
    best = alike[0]
    said = f"{record.name}: {guess(best.change, record, model)}: {instruction(best.change)}"
    others = [instruction(one.change) for one in alike[1:] if one.change.role != best.change.role][:1]
    if others:
        said += f" (or {others[0]}: the record does not tell which)"
    if declared.unexplained >= POOR_MOTION:
        before = f"{100 * declared.unexplained:.0f} %" if declared.unexplained < 1.0 else "all of it"
        return f"{said}; with it the nominal model misses {number(100 * best.unexplained, 2)} % of the motion, without it {before}"
    return (
        f"{said}; without it the model's values come out {math.exp(declared.shift):.3g} times larger or smaller than given, "
        f"with it within a factor of {math.exp(best.shift):.2g}"
    )
