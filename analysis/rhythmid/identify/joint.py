"""Joint maximum likelihood: parameters and both delays together, from the nonlinear model, with the limit cycle as data.

The fit is output error in the time domain on the full simulator. The residuals are whitened, so it is efficient for
Gaussian noise, and it is free of the distortion that biases a linearised machine. This file adds three things: a
start that does not depend on the model's values (the harmonic likelihood, which treats delays as phases and tries
them all), the choice of the data to use, and the test whether the search converged to the right optimum.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.dead_times import dead_times, with_dead_times
from rhythmid.identify.declared import own_model, with_declared
from rhythmid.identify.early_output import EARLIEST
from rhythmid.identify.harmonic_likelihood import (
    DELAYS,
    INPUT_DELAY,
    LONGEST_DELAY,
    MEASUREMENT_DELAY,
    harmonic_likelihood,
)
from rhythmid.identify.initial_step import value_before
from rhythmid.identify.other_starts import from_delays, from_windows
from rhythmid.identify.output_error import Fit, estimate, with_bounds
from rhythmid.identify.search_quality import NOISE_ALONE, Search, cycle_columns, explained
from rhythmid.identify.series import Series, dominant_frequency, prepare
from rhythmid.ltp.pumping import Pumping, active_pumping, pumping_of
from rhythmid.model import Model
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.record import Record

Array = NDArray[np.float64]
MARGIN = (
    0.05  # [s] of a signal that is known before the first sample, beyond the delays that a fit begins with
)
STEP, FINE_STEP = (
    0.2,
    0.05,
)  # integration step as a share of a block; the second where the limit cycle is not used
# required ratio of errors for a delay one period of the motion longer: a periodic motion looks the same a period
# later, except at its start
LATER_PERIOD = 0.7
NO_PUMPING = Pumping(1.0, np.zeros(2, dtype=complex), 0.0, "none")


@dataclass(frozen=True)
class JointFit:
    """Result of the joint fit: the time-domain `fit` to the `records`, its `pumping` (None without forcing), and
    the state of the `search`. `smear` [s] is the time over which the commands are averaged for a drive that takes
    them at a slower rate; 0 where they act as recorded."""

    fit: Fit
    pumping: Pumping | None
    search: Search
    records: tuple[Record, ...]
    smear: float = 0.0

    @property
    def model(self) -> Model:
        return self.fit.model


def prepared_model(model: Model, records: Sequence[Record]) -> tuple[Model, Pumping | None]:
    """The model with both delays and without a forcing that the records already contain; and the pumping of the
    first record.

    Both delays may come out negative by a sample and a half: noise scatters about zero, and an input that is
    simulated as held but is not held acts half a sample early. Neither exceeds the longest record: with a longer
    delay no command acts, and the response does not depend on the delay.
    """
    catalogue = load_catalogue()
    own = [term for term in model.terms if term.element.name == "periodic_forcing"]
    recorded = [pumping_of(record) for record in records]
    pumping = next((p for p in recorded if p is not None and p.active), None)
    if any(p is not None for p in recorded):
        for term in own:
            model = model.without(term.label)
    elif own:
        values = own[0].numbers
        if values["frequency"] > 0.0 and values["amplitude"] != 0.0:
            pumping = Pumping.cosine(values["amplitude"], values["frequency"], values["phase"], "model")
    excited = any(
        record.input is not None and (np.ptp(record.input.value) > 0.0 or value_before(record) is not None)
        for record in records
    )
    wanted = [MEASUREMENT_DELAY] if pumping is not None else []
    wanted += [INPUT_DELAY] if excited else []
    for name in wanted:
        label = name.split(".")[0]
        if model.term(label) is None:
            model = model.with_element(catalogue[label], {"delay": 0.0})
    if not excited and INPUT_DELAY in model.parameters:
        value = model.parameters[INPUT_DELAY]
        model = model.with_parameters({INPUT_DELAY: replace(value, fixed=True)})
    slack = EARLIEST * max(record.output.period for record in records)
    longest = max(record.duration for record in records)
    bounds = {}
    for name in DELAYS:
        if name in model.free:
            low, high = model.parameters[name].bounds
            bounds[name] = (-slack if low == 0.0 else low, min(high, max(longest, low)))
    return with_bounds(model, bounds), pumping


def without_forcing(model: Model) -> Model:
    for term in model.terms:
        if term.element.name == "periodic_forcing":
            model = model.without(term.label)
    return model


def _begun(record: Record, delay: float) -> Record:
    """The record from the time at which command and forcing are known `delay` [s] back; the whole record if it began with a step from
    rest."""
    if value_before(record) is not None:
        return record
    known = [c.time[0] for c in (record.input, record.forcing) if c is not None and len(c) > 0]
    first = int(np.searchsorted(record.output.time, max(known, default=-np.inf) + delay))
    if first == 0 or first > len(record.output) // 2:
        return record
    output = record.output
    return replace(record, output=replace(output, time=output.time[first:], value=output.value[first:]))


def _start(model: Model, records: Sequence[Record], pumping: Pumping | None) -> list[Model]:
    """Models with values from the harmonic likelihood of each record, best first; empty where it cannot be applied."""
    found: list[tuple[float, Model]] = []
    plain = without_forcing(model)
    for record in sorted(records, key=lambda r: -r.duration)[:3]:
        if (
            record.input is None
            or np.ptp(record.input.value) == 0.0
            or record.input_kind == "base_displacement"
        ):
            continue
        try:
            own = (pumping_of(record) or pumping) if pumping is not None else NO_PUMPING
            fit = harmonic_likelihood(record, own_model(plain, record), own or NO_PUMPING, search=True)
        except InputError:
            continue
        values = {name: v for name, v in zip(fit.names, fit.values) if name in model.free}
        low = {name: model.parameters[name].bounds for name in values}
        values = {name: float(np.clip(v, *low[name])) for name, v in values.items()}
        found.append((fit.misfit, model.with_values(values)))
        if fit.misfit < 0.2:
            break
    return [start for _, start in sorted(found, key=lambda pair: pair[0])]


def _starts(
    model: Model,
    records: Sequence[Record],
    stretches: Sequence[Record],
    late: Sequence[str],
    pumping: Pumping | None,
) -> Iterator[Model]:
    """Models to begin with: first, where dead times `late` inside the machine are to be found, its own values with several of them."""
    if late:
        longest = max(begun_series(stretches, 0.0), key=lambda one: one.blocks)
        yield from with_dead_times(model, late, 2.0 * np.pi * dominant_frequency(longest))
    yield from _start(model, records, pumping)


def _search_in_time(model: Model, series: Sequence[Series]) -> Fit:
    """Fit without a start from the harmonics: first short windows with initial states of their own, then delays far
    apart."""
    best: Fit | None = None
    failure: InputError | None = None
    for attempt in (estimate, from_windows):
        try:
            trial = attempt(model, series)
        except InputError as error:
            failure = error
            continue
        if best is None or trial.sum_of_squares < best.sum_of_squares:
            best = trial
        if best.nrmse() < 0.1:
            return best
    if best is None:
        assert failure is not None
        raise failure
    apart = np.linspace(0.0, LONGEST_DELAY, 9)[1:]
    return from_delays(best, {name: apart for name in DELAYS if name in best.names})


def joint_likelihood(records: Record | Sequence[Record], model: Model) -> JointFit:
    """The estimate of `best_fit`, if the search converged.

    Arguments as there. Raises InputError when the records have nothing to fit, and when the search did not
    converge: a fit from a stuck search is never returned.
    """
    found = best_fit(records, model)
    if found.search.arrived:
        return found
    raise InputError(
        f"no answer: {found.search}; either the search is stuck or the machine has physics that the model lacks: "
        "start from better values or other delays, or run `rhythmid diagnose`"
    )


def best_fit(records: Record | Sequence[Record], model: Model) -> JointFit:
    """Estimate all free parameters of the model and its delays from all records together.

    Parameters
    ----------
    records : recordings of the same machine.
    model : prior knowledge of the machine; its values may be far off.

    Returns the best fit; its `search` says whether it converged. Among delays that are whole periods of the motion
    apart, the shortest that fit about as well are chosen. Raises InputError when the records have nothing to fit.
    """
    return of_shortest_delays(_best_fit(records, model))


def of_shortest_delays(found: JointFit) -> JointFit:
    """Among fits whose delays are whole periods of the motion apart, the one with the shortest delays that fits
    about as well."""
    while (shorter := _a_period_earlier(found)) is not None:
        found = shorter
    return found


def _a_period_earlier(found: JointFit) -> JointFit | None:
    """A fit whose total delay is one period of the motion shorter, where it is about as good; else None."""
    free = [name for name in DELAYS if name in found.fit.names]
    period = 1.0 / dominant_frequency(max(found.fit.run.series, key=lambda one: one.blocks), finer=8)
    model, rest = found.fit.model, period
    if sum(model.value(name) for name in free) < period - EARLIEST * found.records[0].output.period:
        return None
    for name in free:
        taken = min(max(model.value(name), 0.0), rest)
        model, rest = model.with_values({name: model.value(name) - taken}), rest - taken
    series = begun_series(found.records, late_by(model))
    try:
        fit = estimate(model, series, max_step=step_of(series))
    except InputError:
        return None
    # a descent that returns to its start gives no information
    shorter = sum(fit.model.value(name) for name in free) < sum(found.fit.model.value(n) for n in free)
    return (
        _judged(fit, found.pumping, found.records)
        if shorter and found.fit.nrmse() >= LATER_PERIOD * fit.nrmse()
        else None
    )


def _best_fit(records: Record | Sequence[Record], model: Model) -> JointFit:
    """The best fit, whatever its delays."""
    given = (records,) if isinstance(records, Record) else tuple(records)
    if not given:
        raise InputError("nothing to identify from: give at least one record")
    model, pumping = prepared_model(with_declared(model, given), given)
    uncut, given = given, stretches_of(given)
    late = [name for name in dead_times(model) if name in model.free]
    best: JointFit | None = None
    for start in _starts(model, uncut, given, late, pumping):
        try:
            trial = _judged(_estimated(start, given), pumping, given)
        except InputError:
            continue
        if (
            best is None
            or trial.search.motion + trial.search.response < best.search.motion + best.search.response
        ):
            best = trial
        if trial.search.arrived and (not late or trial.search.over_noise < NOISE_ALONE):
            return trial
    if best is not None and best.search.arrived:
        return best
    series = begun_series(given, 0.0 if pumping is None else 0.2)
    trial = _judged(_search_in_time(model, series), pumping, given)
    if trial.search.arrived or best is None or trial.search.motion < best.search.motion:
        return trial
    return best


def _estimated(start: Model, records: Sequence[Record]) -> Fit:
    """The fit from these values. The records begin where command and forcing are known as far back as the delays reach;
    where the fit's delays are longer than those it began with, it is repeated from there."""
    series = begun_series(records, late_by(start))
    fit = estimate(start, series, max_step=step_of(series))
    if late_by(fit.model) <= _known_back(late_by(start)):
        return fit
    series = begun_series(records, late_by(fit.model))
    return estimate(fit.model, series, max_step=step_of(series))


def fit_from(model: Model, records: Record | Sequence[Record], cycle: bool = True) -> Fit:
    """The fit reached from the model's own values without a search, for values that are known to be close.

    With `cycle` the limit cycle is used as data; without it only the response to the command is.
    """
    given = (records,) if isinstance(records, Record) else tuple(records)
    ready, pumping = prepared_model(with_declared(model, given), given)
    given = stretches_of(given)
    series = begun_series(given, late_by(ready))
    if not cycle and pumping is not None:
        series = [replace(one, ignored=cycle_columns(one, pumping)) for one in series]
    return estimate(ready, series, max_step=step_of(series))


def step_of(series: Sequence[Series]) -> float:
    """Integration step [s]. Its error changes no estimate by more than a tenth of its standard deviation, for noise
    of a thousandth of the motion.

    Without the limit cycle, only the sidebands separate the two delays. They are a thousandth of the motion, which
    needs finer steps.
    """
    share = FINE_STEP if any(one.ignored is not None for one in series) else STEP
    return share * min(one.period * one.block for one in series)


def stretches_of(records: Sequence[Record]) -> tuple[Record, ...]:
    """The records, cut where commands are missing. Stretches whose forcing phase cannot be determined, being too
    short or full of gaps, are left out where another stretch has it."""
    found: list[Record] = []
    for record in records:
        stretches = cut_at_gaps(record).stretches
        if len(stretches) > 1 and active_pumping(record) is not None:
            told = [one for one in stretches if active_pumping(one) is not None]
        else:
            told = list(stretches)
        found += told or [max(stretches, key=lambda s: s.duration)]
    return tuple(found)


def late_by(model: Model) -> float:
    """Time [s] between a command and the measurement of its effect, by a model's delays."""
    names = [*(name for name in DELAYS if name in model.parameters), *dead_times(model)]
    return sum(max(model.value(name), 0.0) for name in names)


def begun_series(records: Sequence[Record], delay: float, block: int | None = None) -> list[Series]:
    """Series of the records from the time at which signals are known `delay` [s] back; `block` as for `prepare`."""
    return prepare([_begun(record, _known_back(delay)) for record in records], block)


def _known_back(delay: float) -> float:
    """Time [s] before the first sample of a series for which signals are known, by the delays that it was begun with."""
    return delay + MARGIN if delay > 0.0 else 0.0


def _judged(fit: Fit, pumping: Pumping | None, records: Sequence[Record]) -> JointFit:
    return JointFit(fit, pumping, explained(fit, pumping), tuple(records))
