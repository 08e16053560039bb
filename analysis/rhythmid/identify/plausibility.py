"""Channels in another unit, with their sign turned round, or input and output exchanged: found against the nominal model.

Natural frequency and damping ratio do not depend on the scale of a channel; gains do. So every channel of a short stretch is
changed as a user may have declared it by mistake, the model is refitted to each, and a change is believed where it explains
what the record as it is declared leaves. Where a free inertia makes up for a scale, no error shows: there the values tell, which
all come out shifted, and go back to the given ones under the right change.

Physics that the model lacks shifts values, too. At one amplitude and speed dry friction looks like more damping, and where the
damping is all that the motion tells, like more of everything; below its resonance a mass on a spring moves against the sign that it has
without the spring. So no change is believed before the record as it is declared has been tried with a dry friction, a constant force and
a spring beside the model's own: they leave a wrong scale as it is, for they do not accelerate a mass.
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
from rhythmid.identify.joint import POOR_MOTION, Search, explained, prepared_model
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.series import Series, dominant_frequency, prepare
from rhythmid.model import INERTIA, Model
from rhythmid.record.record import Record
from rhythmid.report.quantity import number

STRETCH = 15.0  # periods that are looked at: enough for a resonance of 2 % damping to ring down
SHORT = 4.0  # the same where a search may lose its way over a longer stretch, such as in large swings
ITERATIONS = 12  # of each refit: a right change arrives in fewer
BETTER_UNIT = (
    0.4  # share of what is unexplained as declared that a change may leave, besides being below `POOR_MOTION`
)
TRIED = 3  # records that are looked at until one speaks: a motion that does not repeat, such as a whirling pendulum, cannot
SHIFTED, BACK = (
    math.log(4.0),
    math.log(2.0),
)  # mean |log| ratio of the values to the given ones, as declared and with the change
EQUAL, SAME = 1.2, 0.01  # ratio of errors, and difference of them, within which two changes do the same
LEAST_UNIT_FACTOR = (
    4.0  # factor below which a gain is physics (a gain element, a wrong nominal value) and no unit
)
STEP = 0.01  # relative step by which the effect of a gain is taken
TRANSITION = 0.1  # of the usual speed, over which the sign of a friction that is tried turns at first
GAINS = (0.01, 0.03, 0.1, 10.0, 30.0, 100.0)  # from which the scale of an input in a foreign unit is sought


AS_DECLARED = Change("output")


@dataclass(frozen=True)
class Trial:
    """A change with the `unexplained` share that the refitted model leaves under it and the `shift` of the model's values, the mean
    |log| of their ratio to the given ones."""

    change: Change
    unexplained: float
    shift: float
    fit: Fit | None = None


@dataclass(frozen=True)
class Mend:
    """A change that is believed, in words. `certain` where the record as declared cannot be explained, else the values alone
    speak for it."""

    change: Change
    text: str
    certain: bool


def check_plausible(
    model: Model, records: Sequence[Record], pool: ThreadPoolExecutor | None = None
) -> str | None:
    """A warning where the values speak for another unit of a channel.

    Raises InputError with the likely mend where the records as they are declared cannot be explained and another unit or sign of
    a channel, or an exchange of input and output, suits the model.
    """
    mend = likely_mend(model, records, pool)
    if mend is not None and mend.certain:
        raise InputError(mend.text)
    return None if mend is None else mend.text


def likely_mend(
    model: Model, records: Sequence[Record], pool: ThreadPoolExecutor | None = None
) -> Mend | None:
    """The change of a channel under which the model explains the records, or keeps its values; None where they are plausible."""
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
    """The change that explains what the record as declared leaves."""
    trials = [one for change in likely_changes(record, model) if (one := tried(change)) is not None]
    best = min(trials, key=lambda one: one.unexplained, default=declared)
    if not _convinces(best, declared) or best.change.role == "input":
        foreign = _foreign(tried)
        if foreign is not None and _convinces(foreign, best):
            best, trials = foreign, [foreign]
    if not _convinces(best, declared):
        return None
    again = _searched_again(best, record, model, pool)
    if again is not None:  # the search had only lost its way, or physics is missing
        return _shift(record, again, model, tried, pool) if again.shift > SHIFTED else None
    alike = [one for one in trials if one.unexplained <= EQUAL * best.unexplained + SAME]
    return Mend(alike[0].change, _words(record, model, declared, alike), True)


def _searched_again(
    best: Trial, record: Record, model: Model, pool: ThreadPoolExecutor | None
) -> Trial | None:
    """The record as it is declared once more, before a change is believed: from the values that the change has led to, as they are
    and with its factor taken into those that a force is proportional to, and over a shorter stretch."""
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
    """The change that leads all values back, where they are shifted as declared and the error is none the larger for it, and no
    missing physics does that."""
    trials = [one for change in likely_changes(record, model) if (one := tried(change)) is not None]
    back = _back(trials, declared)
    if not back:  # no unit with a name, such as amperes
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
    """Trials that lead the values back and explain the record as well."""
    most = EQUAL * declared.unexplained + SAME
    return [one for one in trials if one.shift < BACK and one.unexplained <= most]


def _with_more(record: Record, model: Model, pool: ThreadPoolExecutor | None) -> Trial | None:
    """The record as it is declared, by the model with a dry friction, a constant force and a spring besides; None where it has them
    already, or the effort along the motion does not tell how large they are about."""
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
    """The factor by which all values that a force is proportional to are shifted together; None where they are not, or are fewer
    than two, for a single one that is off is no unit."""
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
    """Free values, other than zero, in units of force: all of them scale with the force's unit."""
    force = model.units.force
    return [
        n
        for n in model.free
        if model.value(n) != 0.0 and (n == INERTIA or model.parameters[n].unit.startswith(force))
    ]


def _foreign(tried: partial[Trial | None]) -> Trial | None:
    """The input under the gain that suits the model best, such as amperes for N m, where that is far from 1."""
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
    """Relative change of the input that the residual asks for, the model's values held: one step of least squares."""
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
    """The record as it is declared, from several delays: a late start of the response must not look like a turned sign."""
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
) -> Trial | None:
    """The model refitted to a stretch of the record under a change; None where that cannot be simulated."""
    changed = change.applied(record)
    if changed is None:
        return None
    try:
        ready, pumping = prepared_model(model, [changed])
        one = _stretch(prepare([changed])[0], periods)
        noise = replace(WHITE, std=1e-2 * max(float(np.std(one.averaged)), 1e-300))
        fit = estimate(ready, [one], noise=noise, pool=pool, iterations=ITERATIONS)
        return Trial(change, unexplained(explained(fit, pumping)), shift(given or model, fit.model), fit)
    except InputError:
        return None


def unexplained(search: Search) -> float:
    """Share of the motion that a fit leaves, or of the response to the command where that stands out of the noise."""
    return search.motion if search.over_noise < 2.0 else max(search.motion, search.response)


def shift(given: Model, fitted: Model) -> float:
    """Mean |log| of the ratios of a model's free values to those that were given, each within a factor of a million."""
    ratios = []
    for name in given.free:
        value = given.parameters[name]
        if value.value == 0.0 or value.unit in ("s", "Hz"):
            continue
        ratio = abs(fitted.value(name) / value.value)
        ratios.append(min(abs(math.log(max(ratio, 1e-300))), math.log(1e6)))
    return float(np.mean(ratios)) if ratios else 0.0


def _stretch(series: Series, periods: float) -> Series:
    """The first periods of a series."""
    count = int(periods / (dominant_frequency(series) * series.period * series.block)) + 1
    count = min(count, series.blocks)
    samples = count * series.block
    return replace(series, time=series.time[:samples], value=series.value[:samples], used=series.used[:count])


def _words(record: Record, model: Model, declared: Trial, alike: Sequence[Trial]) -> str:
    """What is likely wrong and how to mend it, in one line."""
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
