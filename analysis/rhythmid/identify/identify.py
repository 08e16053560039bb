"""Identify a model and its delays from records: by joint maximum likelihood, with the paper's method beside it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import TYPE_CHECKING, Literal, cast

import numpy as np
from numpy.typing import NDArray

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.admissible import admissible
from rhythmid.identify.caution import Caution, none_told, not_identified, other_unit
from rhythmid.identify.command_jitter import command_jitter, weighed
from rhythmid.identify.declared import own_model, with_declared
from rhythmid.identify.discretisation import with_discretisation_error
from rhythmid.identify.drive import drive_of, driven
from rhythmid.identify.early_output import early_outputs
from rhythmid.identify.effort_note import effort_note
from rhythmid.identify.harmonic_likelihood import DELAYS
from rhythmid.identify.held_out import admitted_unseen, held_out_runs
from rhythmid.identify.identifiability import Forcing, Offset, delays_of, of_told_sum
from rhythmid.identify.identification import Delays, Estimate, Identification, Shown
from rhythmid.identify.inner_delays import dead_times
from rhythmid.identify.joint import JointFit, best_fit
from rhythmid.identify.large_shifts import AGREES, large_shifts, tells_nothing
from rhythmid.identify.moving import moving
from rhythmid.identify.natural_size import are_told
from rhythmid.identify.output_error import Fit
from rhythmid.identify.own_zeros import with_own_zeros
from rhythmid.identify.paper import HARMONICS, PaperResult, paper_method
from rhythmid.identify.paper_conditions import lacks_paper_method, lacks_transfer_functions
from rhythmid.identify.paper_delays import combined, paper_delays
from rhythmid.identify.paper_quality import MISFIT, cycle_nrmse, notes_of, quality_of
from rhythmid.identify.plausibility import SHIFTED, check_plausible, shift
from rhythmid.identify.record_zero import without_record_zero
from rhythmid.identify.search_quality import POOR_MOTION, explained
from rhythmid.identify.timing import compensated, measurement_jitter
from rhythmid.identify.weighting import efficient_fit
from rhythmid.ltp.harmonic_estimate import HarmonicEstimates
from rhythmid.ltp.nonparametric import HtfMethod, harmonic_transfer_functions, smoothed
from rhythmid.ltp.pumping import Pumping, pumping_of
from rhythmid.model import Model
from rhythmid.progress import Tell, counted, silent
from rhythmid.record.cleaning import cleaned
from rhythmid.record.gaps import cut_at_gaps
from rhythmid.record.record import Record
from rhythmid.record.same_recording import check_held_out

if TYPE_CHECKING:
    from rhythmid.body.machine import Machine
    from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
Method = Literal["joint", "paper"]
FRACTION = 0.01  # share of a sample period: a smaller closure is a numerical error, whatever its std
SOURCES = {
    "forcing channel": "the recorded forcing",
    "stated formula": "the forcing stated by its formula",
    "model": "the model's periodic_forcing, which was not recorded,",
}


def paper_hopper() -> Model:
    """Default model: the paper's hopper, equation (10)."""
    text = (files("rhythmid") / "models" / "paper_hopper.yaml").read_text(encoding="utf-8")
    return Model.from_text(text, "paper_hopper.yaml")


def forced_by(model: Model, record: Record) -> tuple[Model, Pumping]:
    """The pumping of a record, and the model without a forcing of its own.

    The record's forcing takes precedence over the model's `periodic_forcing`. Without either the machine is taken as
    unforced.
    """
    own = [term for term in model.terms if term.element.name == "periodic_forcing"]
    for term in own:
        model = model.without(term.label)
    pumping = pumping_of(record)
    if pumping is None and own:
        values = own[0].numbers
        if values["frequency"] > 0.0:
            pumping = Pumping.cosine(values["amplitude"], values["frequency"], values["phase"], "model")
    return model, pumping or Pumping(1.0, np.zeros(2, dtype=complex), 0.0, "none")


def with_delays(model: Model, input_delay: float, measurement_delay: float) -> Model:
    """The model with these transport delays [s]; missing delay elements are added."""
    for label, delay in (("input_delay", input_delay), ("measurement_delay", measurement_delay)):
        if model.term(label) is None:
            model = model.with_element(load_catalogue()[label], {"delay": delay})
        else:
            model = model.with_values({f"{label}.delay": delay})
    return model


def identify(
    records: "Record | JointRecord | Sequence[Record] | Sequence[JointRecord]",
    model: "Model | Machine | None" = None,
    harmonics: int = HARMONICS,
    method: Method = "joint",
    forcing: Forcing | None = None,
    offset: Offset | None = None,
    htf: HtfMethod = "auto",
    tell: Tell = silent,
    holdout: "Record | JointRecord | Sequence[Record] | Sequence[JointRecord]" = (),
) -> Identification:
    """Identify a model's free parameters and its delays from records.

    Parameters
    ----------
    records
        One or more recordings of the same machine.
    model
        Prior knowledge of the machine; None for the paper's hopper.
    harmonics
        M, the number of sidebands on either side that the paper's method estimates.
    method
        `joint` maximum likelihood, or the `paper`'s two steps.
    forcing
        How the forcing reaches the machine; see `delays_of`.
    offset
        Prior knowledge of the offset of the forcing's clock [s].
    htf
        Estimator of the harmonic transfer functions of the first record; see `harmonic_transfer_functions`. With
        `auto` the paper's method uses its own, equation (5).
    tell
        Called with a sentence at the start of each step.
    holdout
        Records for validation only: they are not used in the fit, and the identified model is simulated over them.

    Returns
    -------
    Identification
        A fit that leaves more than a fifth of the motion unexplained is not `usable`. A machine with several joints
        gives a `MachineIdentification`.

    Raises
    ------
    InputError
        When a record is both fitted and held out, when most of an output is clipped, or when a channel seems to
        have another unit or sign, or to be exchanged with another. By the paper's method also for a record without
        input or shorter than a period, or without a limit cycle.

    Examples
    --------
    >>> import rhythmid as rh
    >>> machine = rh.Model.from_text(
    ...     '''
    ... inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
    ... force:
    ...   - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
    ...   - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
    ... '''
    ... )
    >>> run = {
    ...     "excitation": {"type": "chirp", "amplitude": 1.0, "sweep": 6.0},
    ...     "forcing": {"amplitude": 0.0},
    ...     "noise": {"measurement_std": 1e-5},
    ... }
    >>> guess = machine.with_values({"linear_spring.stiffness": 180.0})
    >>> found = rh.identify(rh.simulate(machine, run).record, guess)
    >>> stiffness = found.parameters["linear_spring.stiffness"]
    >>> abs(stiffness.value - 200.0) < 5 * stiffness.std < 0.01
    True
    >>> found.covariance.correlation.shape == (len(found.covariance.names),) * 2
    True
    """
    given = tuple(records) if isinstance(records, Sequence) else (records,)
    judged = tuple(holdout) if isinstance(holdout, Sequence) else (holdout,)
    if not given:
        raise InputError("nothing to identify from: give at least one record")
    if model is not None and not isinstance(model, Model):
        # imported here because it needs MuJoCo
        from rhythmid.identify.joints.joint_identification import identify_machine

        if (method, forcing, offset, htf) != ("joint", None, None, "auto"):
            raise InputError("method, forcing, offset and htf are for a machine of one axis; leave them out")
        first, second = (cast("Sequence[JointRecord]", one) for one in (given, judged))
        return cast(Identification, identify_machine(first, model, second, tell))
    if not all(isinstance(record, Record) for record in (*given, *judged)):
        raise InputError(
            "these records are of several joints: give a model with a body:, as Model.load reads it"
        )
    check_held_out(given, judged)
    machine = model or paper_hopper()
    clean, still = moving([cleaned(one) for one in cast(tuple[Record, ...], given)])
    fitted = tuple(driven(one.record, machine) for one in clean)
    drives = [note for one, b in zip(clean, fitted) if (note := drive_of(one.record, b)) is not None]
    drives += early_outputs(fitted)
    cut = [note for one in fitted for note in cut_at_gaps(one).notes]
    unseen, said = admitted_unseen(cast(tuple[Record, ...], judged), fitted, machine)
    found = _identified(fitted, model, harmonics, method, forcing, offset, htf, tell)
    balanced = None if found.usable else effort_note(fitted, machine, found.quality["nrmse"])
    said = (*said, *(() if balanced is None else (balanced,)))
    notes = (*still, *(note for one in clean for note in one.notes), *drives, *cut, *said, *found.notes)
    kept = admissible(found.model, machine, None if found.joint is None else found.joint.fit.std)
    notes += kept.notes
    if not unseen:
        return replace(found, model=kept.model, notes=notes)
    tell("running the identified model over the held-out records")
    seen = held_out_runs(found.model, found.joint, fitted, unseen)
    return replace(found, model=kept.model, notes=(*notes, *seen.notes), held_out=seen)


def _identified(
    given: tuple[Record, ...],
    model: Model | None,
    harmonics: int,
    method: Method,
    forcing: Forcing | None,
    offset: Offset | None,
    htf: HtfMethod,
    tell: Tell,
) -> Identification:
    nominal = with_declared(model or paper_hopper(), given)
    pumpings: list[Pumping] = []
    results: list[PaperResult | str] = []
    for record in counted(given, len(given), "transfer functions, record by record", tell):
        own, pumping = forced_by(own_model(nominal, record), record)
        pumpings.append(pumping)
        try:
            results.append(paper_method(record, own, pumping, harmonics if pumping.active else 0))
        except InputError as error:
            if method == "paper":
                raise
            results.append(str(error))
    seen = _Seen(given, nominal, tuple(pumpings), tuple(results))
    found = _by_likelihood(seen, forcing, offset, htf, tell) if method == "joint" else None
    return found or _by_paper(
        seen, htf if method == "joint" or htf != "auto" else "regularised_least_squares"
    )


@dataclass(frozen=True)
class _Seen:
    """Records with the nominal model, their pumping, and the results of the paper's method or the reason for none."""

    records: tuple[Record, ...]
    nominal: Model
    pumpings: tuple[Pumping, ...]
    results: tuple[PaperResult | str, ...]

    @property
    def paper(self) -> tuple[PaperResult, ...]:
        """Results record by record; empty where one record gives none."""
        found = tuple(one for one in self.results if not isinstance(one, str))
        return found if len(found) == len(self.results) else ()

    @property
    def source(self) -> str:
        return self.pumpings[0].source

    def shown(self, method: Method, htf: HtfMethod) -> "Shown":
        """Transfer functions to report; all of them where they were requested by name."""
        pumping, result = self.pumpings[0], self.results[0]
        missing = lacks_transfer_functions(pumping, result) if method == "joint" and htf == "auto" else None
        lacks = lacks_paper_method(pumping, result) if method == "joint" else None
        if isinstance(result, str):
            return Shown(None, False, missing or result, lacks or result)
        functions = None if missing else _harmonics(result, htf)
        by_paper = functions is not None and functions.method == "regularised_least_squares"
        if by_paper and htf == "auto" and lacks:
            functions, missing = None, lacks  # equation (5) of the paper has the same conditions
        return Shown(functions, lacks is None, missing, lacks)

    def judged(
        self,
        fitted: Model,
        parameters: Mapping[str, Estimate],
        delays: Delays,
        joint: JointFit | None,
        nrmse: float,
    ) -> tuple[Caution, ...]:
        """Reasons to doubt the estimates. Raises InputError where a channel is in another unit."""
        stuck = joint is not None and not joint.search.arrived
        cautions = large_shifts(self.nominal, parameters, delays, self.records)
        if joint is not None and not stuck and nrmse <= POOR_MOTION and tells_nothing(parameters, delays):
            return (none_told(), *cautions)
        if not stuck and nrmse <= POOR_MOTION and shift(self.nominal, fitted) <= SHIFTED:
            return cautions
        mend = check_plausible(self.nominal, self.records)
        told = () if mend is None else (other_unit(mend),)
        if not stuck and nrmse <= POOR_MOTION:
            return (*told, *cautions)
        response = joint.search.response if joint is not None and nrmse <= POOR_MOTION else None
        return (not_identified(nrmse, response), *told, *cautions)


def _by_paper(seen: _Seen, htf: HtfMethod) -> Identification:
    """Parameters and delays by the paper's method: average over records, weighted by inverse variance."""
    records, results = seen.records, seen.paper
    first = results[0]
    units = first.fit.model.parameters
    parameters = {
        name: Estimate(*combined([(r.fit.values[i], r.fit.std[name]) for r in results]), units[name].unit)
        for i, name in enumerate(first.fit.names)
    }
    delays = paper_delays(results, seen.source)
    fitted = first.fit.model.with_values({n: e.value for n, e in parameters.items() if e.value is not None})
    if delays.separable:
        assert delays.input.value is not None and delays.measurement.value is not None
        fitted = with_delays(fitted, delays.input.value, delays.measurement.value)
    else:  # a simulation needs only the sum, in either place
        fitted = with_delays(fitted, delays.sum.value or 0.0, 0.0)
    nrmse = cycle_nrmse(fitted, records, results)
    cautions = seen.judged(fitted, parameters, delays, None, nrmse)
    notes = tuple(note for result, one in zip(results, records) for note in notes_of(one, result))
    return Identification(
        fitted, records, parameters, delays, seen.shown("paper", htf), results, quality_of(nrmse, records, results),
        notes, cautions=cautions,
    )  # fmt: skip


def _by_likelihood(
    seen: _Seen, forcing: Forcing | None, offset: Offset | None, htf: HtfMethod, tell: Tell
) -> Identification | None:
    """Parameters and delays by joint maximum likelihood; HTFs without a model; None where only these can be given, because a cycle of
    unknown forcing cannot be simulated."""
    records, paper = seen.records, seen.paper
    unforced = paper and not any(one.active for one in seen.pumpings)
    tell("fitting the model to all records at once")
    try:
        found = best_fit(records, seen.nominal)
    except InputError:
        if unforced:
            return None
        check_plausible(seen.nominal, records)
        raise
    found, zeros = with_own_zeros(found)
    if unforced and not found.search.arrived and paper[0].fit.misfit < MISFIT:
        return None
    tell("testing for drifting clocks and held commands")
    joint, notes = compensated(found) if found.search.arrived else (found, ())
    notes = (*zeros, *notes)
    late = command_jitter(joint.fit) if joint.search.arrived else None
    if late is not None:
        joint, notes = replace(joint, fit=weighed(joint.fit, late)), (*notes, late.words)
    fit = with_discretisation_error(efficient_fit(joint.fit))
    joint = replace(joint, fit=fit, search=explained(fit, joint.pumping))
    series = fit.run.series
    jitter = measurement_jitter(fit)
    late_by = (None, None) if late is None else (late.std, late.uncertainty)
    quality = quality_of(fit.nrmse(), records, paper) | {
        "unexplained_response": joint.search.response,
        "averaged": series[0].block,
        "noise_std": math.sqrt(fit.noise.variance * series[0].block),
        "measurement_jitter": jitter.to_dict(),
        "command_jitter": Estimate(*late_by, "s").to_dict(),
    }
    delays = delays_of(joint, forcing, offset, SOURCES.get(seen.source, "the forcing"))
    delays = of_told_sum(delays, fit.model, series)
    parameters = _told_values(fit, delays)
    cautions = seen.judged(fit.model, parameters, delays, joint, fit.nrmse())
    if _open(delays, records[0].output.period):
        notes += (
            f"limit cycle and response to the command disagree about the delays by {delays.closure:+.1f} standard "
            "deviations: the model lacks physics, or the forcing's phase is not the acting one; run `rhythmid diagnose`",
        )
    shown = seen.shown("joint", htf)
    results = paper if shown.paper else (None,) * len(records)
    notes += tuple(note for result, one in zip(results, records) for note in notes_of(one, result))
    return Identification(
        without_record_zero(fit.model), records, parameters, delays, shown, paper, quality, notes, joint, cautions,
    )  # fmt: skip


def _told_values(fit: Fit, delays: Delays) -> dict[str, Estimate]:
    """Estimates of all parameters but the delays, without those of which the records tell nothing."""
    known = fit.model.parameters
    found = {name: (known[name].value, fit.std[name]) for name in fit.names if name not in DELAYS}
    inner = {name: delays.inner.get(label) for name, label in dead_times(fit.model).items()}
    refused = {name for name, one in inner.items() if one is not None and not one.separable}
    told = set(are_told(fit.model, fit.run.series, found)) - refused
    return {
        name: Estimate(*(pair if name in told else (None, None)), known[name].unit)
        for name, pair in found.items()
    }


def _open(delays: Delays, period: float) -> bool:
    """Whether limit cycle and response to the command give different delays; `period` is the sample period [s]."""
    seen = delays.observables
    if seen is None or delays.closure is None or abs(delays.closure) <= AGREES:
        return False
    gap = (seen.phase.value or 0.0) + (seen.offset.value or 0.0) - (seen.slope.value or 0.0)
    return abs(gap) > FRACTION * period


def _harmonics(result: PaperResult, method: HtfMethod) -> HarmonicEstimates:
    """Transfer functions of a record, from the spectra of the paper's method."""
    if method == "regularised_least_squares":
        return smoothed(result.estimate)
    return harmonic_transfer_functions(result.spectra, result.fit.linearised.cycle.ring_down, method)
