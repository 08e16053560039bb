"""Diagnose: detect, locate, name, model, show.

From records and a nominal model to a verdict: the nominal model is calibrated, the catalogue is searched for what it
lacks, the winner is held against noise, rivals and records that no fit has seen, and the answer says how sure it is.
"""

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rhythmid.diagnose.admission import check_driven, tempered, without_clipped
from rhythmid.diagnose.answer.next_experiment import next_experiment
from rhythmid.diagnose.answer.result import (
    Alternative,
    Detection,
    Diagnosis,
    Estimate,
    FitQuality,
    MissingEffect,
    Remainder,
)
from rhythmid.diagnose.answer.wording import location_of, recalibrated, summary_of
from rhythmid.diagnose.baseline import Calibration, causal
from rhythmid.diagnose.confidence import probabilities
from rhythmid.diagnose.delays import delays_of
from rhythmid.diagnose.elsewhere import elsewhere
from rhythmid.diagnose.exclusions import unscored
from rhythmid.diagnose.fine_steps import finely_stepped
from rhythmid.diagnose.gate import admitted
from rhythmid.diagnose.given_value import wrong_value
from rhythmid.diagnose.heldout import HeldOut, tail_error
from rhythmid.diagnose.intervals import profiled
from rhythmid.diagnose.limiting_case import limiting_cases
from rhythmid.diagnose.location import Dependence, dependences
from rhythmid.diagnose.scoring import Scoring, settle
from rhythmid.diagnose.search.forward import WORTH, Search, search
from rhythmid.diagnose.search.score_tests import trajectories
from rhythmid.diagnose.stand_ins import stand_ins
from rhythmid.diagnose.twins import twins_of
from rhythmid.diagnose.unit_check import check_units
from rhythmid.diagnose.verdict import significant, verdict_of
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.drive import drive_of, driven
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, start_only
from rhythmid.identify.repeats import noise_from_repeats
from rhythmid.identify.sample_clock.tick_interval import ticks_followed
from rhythmid.identify.series import Series, prepare, scales
from rhythmid.model import Model
from rhythmid.parallel import cores
from rhythmid.progress import Tell
from rhythmid.record.outlier import without_stray
from rhythmid.record.record import Record

Array = NDArray[np.float64]
SHOWN = 8  # alternatives listed
TIED_SENSOR = "Scored by force: effects in the sensor are not among the candidates, the measurement is taken for the motion."


@dataclass(frozen=True)
class Evidence:
    """Everything behind a diagnosis that a report draws: series, fits, rounds of scores, dependences."""

    series: tuple[Series, ...]
    unseen: tuple[Series, ...]
    calibration: Calibration
    search: Search
    before: tuple[Dependence, ...]
    after: tuple[Dependence, ...]
    unseen_nominal: Fit | None
    unseen_augmented: Fit | None


@dataclass(frozen=True)
class Answer:
    """A diagnosis, the augmented model and the evidence; `mistaken` tells of a value that the nominal model holds fixed and that
    explains the records when it is free, if there is one."""

    diagnosis: Diagnosis
    model: Model
    evidence: Evidence
    mistaken: str | None = None


def diagnose(
    records: Sequence[Record],
    model: Model,
    holdout: Sequence[Record] = (),
    catalogue: Catalogue | None = None,
    tell: Tell = lambda _: None,
) -> Answer:
    """Find the physics that `model` lacks to explain `records`.

    `holdout` records are used to judge only; without any, the last fifth of every record is held out. The result is the
    same whenever the records are. Raises InputError for records or models that cannot be judged.
    """
    if not records:
        raise InputError("no record is given; name at least one bag or table")
    known = catalogue or load_catalogue()
    remark = check_driven((*records, *holdout), model)
    tidy = [without_stray(record) for record in (*records, *holdout)]
    cleaned = [without_clipped(record) for record, _ in tidy]
    given = [driven(record, model) for record, _ in cleaned]
    everything = prepare(given)
    check_comparable(everything)
    count = len(records)
    notes = dict.fromkeys(
        (
            remark,
            *(note for _, said in (*tidy, *cleaned) for note in said),
            *(drive_of(a, b) for (a, _), b in zip(cleaned, given)),
        )
    )
    # the matrices are tall and thin, and workers run side by side: threads inside linear algebra only get in the way
    with threadpool_limits(1), ThreadPoolExecutor(cores()) as pool:
        check_units(model, everything[:count], pool)
        ways = settle(model, everything[:count], everything[count:], known, pool, tell)
        answers: list[Answer] = []
        for scoring in ways:
            if answers:
                tell(f"no name found; scoring in {scoring.words}")
            answers.append(_diagnosed(model, everything[:count], scoring, holdout, known, notes, pool, tell))
            if answers[-1].diagnosis.verdict == "missing_physics" or answers[-1].mistaken:
                return answers[-1]
    return answers[0]


def _diagnosed(
    model: Model,
    whole: Sequence[Series],
    scoring: Scoring,
    holdout: Sequence[Record],
    known: Catalogue,
    remarks: Iterable[str | None],
    pool: ThreadPoolExecutor,
    tell: Tell,
) -> Answer:
    """The diagnosis of `whole` records scored in one way; `remarks` on the records are told with it."""
    notes = dict.fromkeys(remarks)
    calibration, seen, unseen = scoring.calibration, list(scoring.calibration.series), list(scoring.unseen)
    if holdout:
        heldout = f"held out: {', '.join(record.name for record in holdout)}"
    else:
        heldout = f"held out: the last fifth of every {'record' if scoring.whole else 'window'}"
    known = known.within(scales(seen, calibration.fit.model))
    if seen[0].observer is not None:  # which takes the measurement for the motion
        known = known.without(*(name for name, element in known.elements.items() if element.slot == "sensor"))
        notes[TIED_SENSOR] = None
    found = search(seen, calibration.fit, model, known, pool, tell)
    tell("judging on held-out records")
    found, harmful = admitted(found, unseen if holdout else None, pool)
    fitted = scales(seen, found.fit.model)
    imitating = [
        *stand_ins(trajectories(found.fit), found.best.added, fitted),
        *elsewhere(found, known),
    ]
    found = finely_stepped(found, pool)
    imitating += limiting_cases(found)
    found = ticks_followed(profiled(found, pool), pool)
    tell("locating the mismatch")
    before = dependences(trajectories(found.nominal), pool)
    after = dependences(trajectories(found.fit), pool) if found.best.added else before
    judge = HeldOut(found, unseen if holdout else None)
    # a mass on a mass is what a mass that is given wrongly looks like
    heavier = [label for label in found.best.added if found.best.element(label).family == "resonance"]
    mistaken = wrong_value(found) if heavier else None
    if mistaken is not None:
        modes = " and ".join(heavier).replace("_", " ")
        imitating.append(f"{modes} may stand for a value that the nominal model holds fixed")
    diagnosis = _conclude(model, found, calibration, before, after, judge, heldout, harmful, imitating)
    if diagnosis.verdict == "unknown_physics" and not heavier:
        tell("trying the values that the nominal model holds fixed")
        mistaken = wrong_value(found)
    notes[mistaken] = None
    said = (*diagnosis.notes, *(note for note in notes if note is not None))
    excluded = (*diagnosis.excluded, *unscored(found, known, pool))
    diagnosis = replace(diagnosis, scoring=scoring.words, notes=said, excluded=excluded)
    diagnosis = tempered(diagnosis, whole, found, pool)
    nominal_run, augmented_run = judge.fit(found.nominal.model), judge.fit(found.fit.model)
    evidence = Evidence(
        tuple(seen),
        tuple(unseen),
        calibration,
        found,
        tuple(before),
        tuple(after),
        nominal_run,
        augmented_run,
    )
    return Answer(diagnosis, causal(found.fit.model), evidence, mistaken)


def check_comparable(series: Sequence[Series]) -> None:
    """Raise InputError when records cannot come from one machine in one set of units."""
    spread = [float(np.std(one.averaged)) for one in series]
    level = [float(np.mean(one.averaged)) for one in series]
    for one, size in zip(series, spread):
        if size == 0.0:
            raise InputError(f"{one.name}: the output never changes; nothing can be learnt from it")
    for i, one in enumerate(series):
        for j in range(i):
            jump = abs(level[i] - level[j])
            size = max(spread[i], spread[j])
            decades = [abs(math.log10(max(abs(a), 1e-300) / max(abs(b), 1e-300))) for a, b in
                       ((spread[i], spread[j]), (level[i], level[j]))]  # fmt: skip
            thousand = all(2.5 < one < 3.5 for one in decades)
            if (
                thousand
                or jump > 300.0 * size
                or max(spread[i], spread[j]) > 2000.0 * min(spread[i], spread[j])
            ):
                raise InputError(
                    f"{series[j].name} and {one.name} do not look like one machine in one unit (outputs "
                    f"{level[j]:.3g} ± {spread[j]:.3g} and {level[i]:.3g} ± {spread[i]:.3g}); check units and files"
                )


def _floor(series: Sequence[Series], noises: Sequence[NoiseModel]) -> float:
    """Error that noise alone leaves. Repeats that still ring down overstate it, and a fit that is good enough shows less."""
    variance = min(noise.variance for noise in noises)
    power = sum(one.power(one.used) for one in series) / max(sum(int(one.used.sum()) for one in series), 1)
    return math.sqrt(variance / max(power, 1e-300))


def _conclude(
    nominal: Model,
    found: Search,
    calibration: Calibration,
    before: Sequence[Dependence],
    after: Sequence[Dependence],
    judge: HeldOut,
    heldout: str,
    harmful: Sequence[str],
    imitating: Sequence[str],
) -> Diagnosis:
    """Put the verdict and its reasons together."""
    series = found.fit.run.series
    repeats = noise_from_repeats(list(series))
    p_value = found.rounds[0].p_value
    remains = [d for d in after if significant(d)]
    rivals = [
        t
        for t in found.trials
        if len(t.added) == len(found.best.added) and t.bic() - found.best.bic() < WORTH
    ]
    twins = twins_of(found.best, rivals)
    verdict, reason = verdict_of(
        found, p_value, remains, twins, repeats, series, judge.uncarried(), imitating
    )
    chance = probabilities(found)
    best = found.best
    missing: list[MissingEffect] = []
    for label in best.added:
        term = best.model.term(label)
        assert term is not None
        missing.append(
            MissingEffect(
                term.element.name, term.element.slot, term.element.equation, chance.get(label, 0.0),
                {name: _estimate(found.fit, f"{label}.{name}") for name in term.values},
            )
        )  # fmt: skip
    if verdict in ("consistent", "unknown_physics") and not best.added:
        missing = []
    location = location_of(found, missing, before, verdict)
    experiment = next_experiment(found, rivals, series, verdict)
    augmented = FitQuality(found.fit.nrmse(), judge.nrmse(found.fit.model, found.fit))
    plain = FitQuality(found.nominal.nrmse(), judge.nrmse(found.nominal.model, found.nominal))
    shown = [t for t in found.trials if set(t.added) != set(best.added)][:SHOWN]
    alternatives = tuple(
        Alternative(
            tuple(t.element(label).name for label in t.added),
            t.bic() - best.bic(),
            judge.nrmse(t.model) if judge.fit(t.model) is not None else tail_error(found, t),
        )
        for t in shown
    )
    remainder = None
    if remains:
        top = max(remains, key=lambda d: d.gain)
        remainder = Remainder(
            top.quantity,
            top.explained,
            top.p_value,
            tuple(map(float, top.grid)),
            tuple(map(float, top.force)),
        )
    detection = Detection(
        p_value,
        _nominal_error(nominal, found),
        plain.train_nrmse,
        _floor(series, [found.noise, *([repeats] if repeats is not None else [])]),
    )
    return Diagnosis(
        verdict=verdict,
        summary=summary_of(verdict, reason, missing, plain, augmented, twins, series[0].whole),
        detection=detection,
        location=location,
        missing=tuple(missing),
        indistinguishable=tuple(sorted(twins)),
        alternatives=alternatives,
        refitted_nominal=plain,
        augmented=augmented,
        parameters={name: _estimate(found.fit, name) for name in found.fit.model.parameters},
        delays=delays_of(found.fit),
        next_experiment=experiment,
        calibration=(*calibration.notes, *recalibrated(nominal, found.fit)),
        excluded=(*(f"{' + '.join(added)}: {why}" for added, why in found.excluded), *harmful),
        heldout=heldout,
        remainder=remainder,
    )


def _estimate(fit: Fit, name: str) -> Estimate:
    value = fit.model.parameters[name]
    std = fit.std.get(name)
    if std is not None and (not math.isfinite(std) or std > max(1e6 * abs(value.value), 1e-3)):
        std = None
    return Estimate(value.value, 0.0 if name not in fit.names else std, value.unit)


def _nominal_error(nominal: Model, found: Search) -> float:
    """Free-run error of the nominal model exactly as given, its initial states fitted."""
    fit = found.nominal
    values = {name: value.value for name, value in nominal.parameters.items() if name in fit.model.parameters}
    model = fit.model.with_values(values)
    run = prepare_run(model, fit.run.series, fit.run.max_step)
    try:
        again = start_only(model, fit.run.series, found.noise, run.max_step)
    except InputError:
        return math.inf
    return again.nrmse()
