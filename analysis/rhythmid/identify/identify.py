"""Identify a model and its delays from records: by joint maximum likelihood, with the paper's method beside it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.resources import files
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.declared import own_model, with_declared
from rhythmid.identify.delay_fit import DelayEstimate
from rhythmid.identify.harmonic_likelihood import DELAYS
from rhythmid.identify.identifiability import Forcing, Offset, delays_of
from rhythmid.identify.identification import Delays, Estimate, Identification
from rhythmid.identify.joint import joint_likelihood
from rhythmid.identify.paper import HARMONICS, PaperResult, paper_method
from rhythmid.identify.timing import compensated, measurement_jitter
from rhythmid.ltp.harmonic_estimate import HarmonicEstimates
from rhythmid.ltp.nonparametric import HtfMethod, harmonic_transfer_functions, smoothed
from rhythmid.ltp.pumping import Pumping, pumping_of
from rhythmid.model import Model
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.outlier import without_stray
from rhythmid.record.record import Record
from rhythmid.simulation.signal import continuous, spline
from rhythmid.simulation.simulate import simulate

Array = NDArray[np.float64]
Method = Literal["joint", "paper"]
UNKNOWN = 1e3  # times its value: a standard deviation beyond which a parameter is not determined at all
CLOSED = 5.0  # standard deviations of the closure that call for a note
FRACTION = 0.01  # of a sample period, below which a closure is numerical, whatever its standard deviation
SOURCES = {
    "forcing channel": "the recorded forcing",
    "stated formula": "the forcing stated by its formula",
    "model": "the model's periodic_forcing, which was not recorded,",
}
ON_ROBOT = "the forcing acts on the machine undelayed"
ASSUMPTIONS = {
    "forcing channel": f"{ON_ROBOT}, and the recorded forcing has the phase that acts, on the clock of the measurements",
    "stated formula": f"{ON_ROBOT}, with the phase stated for it in the record's time",
    "model": f"{ON_ROBOT}, with the phase that the model's periodic_forcing has in the record's time; it was not recorded",
}
LEAKAGE = 0.05  # above which a record's leakage is told
MISFIT = 0.1  # of the magnitudes above which the fit is called into question
NO_PHASE = (
    "the excitation reaches too few frequencies to read a delay from phases; excite more of them, or a chirp"
)
NO_SIDEBANDS = (
    "the excitation reaches the sidebands at too few frequencies to tell the two delays apart by their phases"
)
NO_FORCING = "no forcing is known, so nothing tells when the machine's cycle is at which phase"


def paper_hopper() -> Model:
    """The model that is used where none is given: the paper's hopper, equation (10)."""
    text = (files("rhythmid") / "models" / "paper_hopper.yaml").read_text(encoding="utf-8")
    return Model.from_text(text, "paper_hopper.yaml")


def forced_by(model: Model, record: Record) -> tuple[Model, Pumping]:
    """The pumping of a record and the model without a forcing of its own.

    The record's forcing wins over the model's `periodic_forcing`. Where neither is there the machine is taken as not
    forced.
    """
    own = [term for term in model.terms if term.element.name == "periodic_forcing"]
    for term in own:
        model = model.without(term.label)
    pumping = pumping_of(record)
    if pumping is None and own:
        values = {name: value.value for name, value in own[0].values.items()}
        if values["frequency"] > 0.0:
            pumping = Pumping.cosine(values["amplitude"], values["frequency"], values["phase"], "model")
    return model, pumping or Pumping(1.0, np.zeros(2, dtype=complex), 0.0, "none")


def with_delays(model: Model, input_delay: float, measurement_delay: float) -> Model:
    """The model with these transport delays [s], whose elements are added where it lacks them."""
    catalogue = (
        load_catalogue()
        if not {"input_delay", "measurement_delay"} <= {t.label for t in model.terms}
        else None
    )
    for label, delay in (("input_delay", input_delay), ("measurement_delay", measurement_delay)):
        if model.term(label) is None:
            assert catalogue is not None
            model = model.with_element(catalogue[label], {"delay": delay})
        else:
            model = model.with_values({f"{label}.delay": delay})
    return model


def free_run_nrmse(model: Model, record: Record, start: Array) -> float:
    """rms(simulated − measured) / std(measured) in free-run simulation from the state `start` at the first sample."""
    command = None if record.input is None else continuous(record.input.time, record.input.value, record.hold)
    forcing = None if record.forcing is None else spline(record.forcing.time, record.forcing.value)
    simulated = simulate(model, record.output.time, command, forcing, start).output
    return float(np.sqrt(np.mean((simulated - record.output.value) ** 2)) / np.std(record.output.value))


def _combined(estimates: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean of independent (value, std), each weighed by its variance."""
    if len(estimates) == 1:
        return estimates[0]
    values = np.array([value for value, _ in estimates])
    weight = np.array([1.0 / max(std, 1e-300) ** 2 if math.isfinite(std) else 0.0 for _, std in estimates])
    if weight.sum() == 0.0:
        return float(values.mean()), math.inf
    return float(weight @ values / weight.sum()), float(1.0 / math.sqrt(weight.sum()))


def _cycle_delay(result: PaperResult) -> float:
    """Measurement delay [s], modulo the period, by which the limit cycle's fundamental lags behind the model's."""
    model = result.fit.linearised.cycle.harmonics(1)[1]
    return float(-np.angle(result.spectra.cycle[1] / model) / result.pumping.omega)


def _closure(result: PaperResult, combined: DelayEstimate) -> float | None:
    """(A + C − B) / std with A the limit cycle's phase, C the sidebands' offset, B the slope of G_0."""
    whole, sided = result.delays.get(0), [d for m, d in result.delays.items() if m != 0]
    if whole is None or not sided or combined.input is None or combined.measurement is None:
        return None
    best = min(sided, key=lambda d: d.input_std or math.inf)
    assert best.input is not None and best.input_std is not None
    period = result.pumping.period
    gap = _cycle_delay(result) + best.input - whole.sum
    gap = (gap + 0.5 * period) % period - 0.5 * period
    return gap / math.hypot(best.input_std, whole.sum_std)


def _delays(results: Sequence[PaperResult], source: str) -> Delays:
    def estimate(pairs: Sequence[tuple[float, float]]) -> Estimate:
        return Estimate(*_combined(pairs), "s")

    nothing = Estimate(None, None, "s")
    found = [result.combined for result in results]
    if source == "none" or any(one is None for one in found):
        whole = [result.delays[0] for result in results if 0 in result.delays]
        if not whole:
            raise InputError(NO_PHASE)
        total = estimate([(one.sum, one.sum_std) for one in whole])
        return Delays(nothing, nothing, total, False, NO_FORCING if source == "none" else NO_SIDEBANDS)
    pairs = [one for one in found if one is not None]
    return Delays(
        estimate([(one.input or 0.0, one.input_std or 0.0) for one in pairs]),
        estimate([(one.measurement or 0.0, one.measurement_std or 0.0) for one in pairs]),
        estimate([(one.sum, one.sum_std) for one in pairs]),
        True,
        ASSUMPTIONS.get(source, ON_ROBOT),
        _closure(results[0], pairs[0]),
        pairs[0].aliases,
    )


def identify(
    records: Record | Sequence[Record],
    model: Model | None = None,
    harmonics: int = HARMONICS,
    method: Method = "joint",
    forcing: Forcing | None = None,
    offset: Offset | None = None,
    htf: HtfMethod = "auto",
) -> Identification:
    """Identify a model's free parameters and its delays from records.

    Parameters
    ----------
    records : one or more recordings of the same machine.
    model : what is known of it; the paper's hopper where None.
    harmonics : M, sidebands on either side that the paper's method estimates.
    method : `joint` maximum likelihood, or the `paper`'s two steps.
    forcing, offset : how the forcing reaches the machine, and what is known of its clock; see `delays_of`.
    htf : how the harmonic transfer functions of the first record are found; see `harmonic_transfer_functions`. The paper's
        method brings its own, equation (5), where this is `auto`.

    Raises InputError when the joint search did not arrive (never is a stuck fit returned), and when a record has no
    input, is shorter than a period, or the model has no limit cycle.
    """
    given = (records,) if isinstance(records, Record) else tuple(records)
    if not given:
        raise InputError("nothing to identify from: give at least one record")
    tidy = [without_stray(record) for record in given]
    cut = [note for record, _ in tidy for note in cut_at_gaps(record).notes]
    found = _identified(tuple(record for record, _ in tidy), model, harmonics, method, forcing, offset, htf)
    return replace(found, notes=(*(note for _, said in tidy for note in said), *cut, *found.notes))


def _identified(
    given: tuple[Record, ...],
    model: Model | None,
    harmonics: int,
    method: Method,
    forcing: Forcing | None,
    offset: Offset | None,
    htf: HtfMethod,
) -> Identification:
    nominal = with_declared(model or paper_hopper(), given)
    results: list[PaperResult] = []
    pumpings: list[Pumping] = []
    for record in given:
        own, pumping = forced_by(own_model(nominal, record), record)
        results.append(paper_method(record, own, pumping, harmonics if pumping.active else 0))
        pumpings.append(pumping)
    if method == "joint":
        try:
            return _joint(given, nominal, results, pumpings[0].source, forcing, offset, htf)
        except InputError:
            if any(pumping.active for pumping in pumpings):
                raise
            # a cycle whose forcing is unknown cannot be simulated; the transfer functions around it can still be fitted
    first = results[0]
    units = first.fit.model.parameters
    parameters = {
        name: Estimate(*_combined([(r.fit.values[i], r.fit.std[name]) for r in results]), units[name].unit)
        for i, name in enumerate(first.fit.names)
    }
    delays = _delays(results, pumpings[0].source)
    fitted = first.fit.model.with_values({n: e.value for n, e in parameters.items() if e.value is not None})
    if delays.separable:
        assert delays.input.value is not None and delays.measurement.value is not None
        fitted = with_delays(fitted, delays.input.value, delays.measurement.value)
    else:  # what a simulation needs is the sum, wherever it stands
        fitted = with_delays(fitted, delays.sum.value or 0.0, 0.0)
    return Identification(
        fitted, given, parameters, delays, _harmonics(first, htf if method == "joint" or htf != "auto" else "regularised_least_squares"),
        tuple(results), _quality(_nrmse(fitted, given, results), given, results), tuple(note for r, one in zip(given, results) for note in _notes(r, one)),
    )  # fmt: skip


def _joint(
    records: tuple[Record, ...],
    nominal: Model,
    results: Sequence[PaperResult],
    source: str,
    forcing: Forcing | None,
    offset: Offset | None,
    htf: HtfMethod,
) -> Identification:
    """Parameters and delays by joint maximum likelihood; HTFs without a model."""
    joint, notes = compensated(joint_likelihood(records, nominal))
    fit = joint.fit
    own = [name for name in fit.names if name not in DELAYS]
    values = fit.model.parameters
    parameters = {
        name: Estimate(values[name].value, fit.std[name], values[name].unit)
        if fit.std[name] < UNKNOWN * max(abs(values[name].value), 1e-9)
        else Estimate(None, None, values[name].unit)
        for name in own
    }
    first = results[0]
    jitter = measurement_jitter(fit)
    quality = _quality(fit.nrmse(), records, results) | {
        "unexplained_response": joint.search.response,
        "noise_std": math.sqrt(fit.noise.variance * fit.run.series[0].block),
        "measurement_jitter": jitter.to_dict(),
    }
    delays = delays_of(joint, forcing, offset, SOURCES.get(source, "the forcing"))
    if _open(delays, records[0].output.period):
        notes += (
            f"limit cycle and response to the command disagree about the delays by {delays.closure:+.1f} standard "
            "deviations: the model lacks physics, or the forcing's phase is not the acting one; run `rhythmid diagnose`",
        )
    notes += tuple(note for result, one in zip(results, records) for note in _notes(one, result))
    return Identification(
        fit.model, records, parameters, delays, _harmonics(first, htf), tuple(results), quality,
        notes, joint,
    )  # fmt: skip


def _open(delays: Delays, period: float) -> bool:
    """Whether limit cycle and response to the command disagree about the delays; `period` [s] between samples."""
    seen = delays.observables
    if seen is None or delays.closure is None or abs(delays.closure) <= CLOSED:
        return False
    gap = (seen.phase.value or 0.0) + (seen.offset.value or 0.0) - (seen.slope.value or 0.0)
    return abs(gap) > FRACTION * period


def _harmonics(result: PaperResult, method: HtfMethod) -> HarmonicEstimates:
    """Transfer functions of a record, whose spectra the paper's method has at hand."""
    if method == "regularised_least_squares":
        return smoothed(result.estimate)
    return harmonic_transfer_functions(result.spectra, result.fit.linearised.cycle.ring_down, method)


def _notes(record: Record, result: PaperResult) -> Iterator[str]:
    """What should make a user doubt the record, or the paper's method here."""
    yield from (f"{record.name}: {note}" for note in record.quality.notes)
    window, operator = result.spectra.window, result.estimate.operator
    if window.leakage > LEAKAGE:
        yield (
            f"{record.name}: the command does not repeat over whole pumping periods, so its response leaks "
            f"({window.leakage:.0%}): begin with a warm-up repetition, or leave silence at both ends"
        )
    apart = operator.spacing * operator.spectra.resolution
    if apart * np.pi * result.fit.linearised.cycle.ring_down > 1.0:
        yield (
            f"{record.name}: the excited frequencies are {apart:.3g} Hz apart, wider than the machine's resonance: HTFs "
            "between them are interpolated; excite denser lines"
        )
    if result.fit.misfit > MISFIT:
        yield f"{record.name}: the model leaves {result.fit.misfit:.0%} of the HTFs' magnitudes unexplained"


def _nrmse(model: Model, records: Sequence[Record], results: Sequence[PaperResult]) -> float:
    """Largest free-run NRMSE of a model that starts on its limit cycle."""
    nrmse = 0.0
    for record, result in zip(records, results):
        cycle, delay = result.fit.linearised.cycle, model.value("measurement_delay.delay")
        begin = (record.output.time[0] - delay - result.pumping.origin) % result.pumping.period
        nrmse = max(nrmse, free_run_nrmse(own_model(model, record), record, cycle.path(begin)))
    return nrmse


def _quality(nrmse: float, records: Sequence[Record], results: Sequence[PaperResult]) -> dict[str, Any]:
    channels = [record.quality for record in records]
    first = results[0]
    return {
        "rate": 1.0 / records[0].output.period,
        "gaps": sum(q.gaps for q in channels if q.channels),
        "jitter_std": max((q.jitter_std for q in channels if q.channels), default=0.0),
        "nrmse": nrmse,
        "periods": first.spectra.window.periods,
        "leakage": first.spectra.window.leakage,
        "smoothing_window": first.estimate.operator.window,
        "smoothing_loss": {f"{m:+d}": float(v) for m, v in zip(first.estimate.htf.harmonics, first.loss)},
    }
