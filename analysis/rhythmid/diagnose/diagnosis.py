"""Diagnose: detect, locate, name, model, show.

From records and a nominal model to a verdict: the nominal model is calibrated, the catalogue is searched for what it
lacks, the winner is held against noise, rivals and records that no fit has seen, and the answer says how sure it is.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rhythmid.diagnose.calibrate import Calibration, calibrate
from rhythmid.diagnose.confidence import probabilities
from rhythmid.diagnose.delays import delays_of
from rhythmid.diagnose.locate import Dependence, dependences
from rhythmid.diagnose.next_experiment import next_experiment
from rhythmid.diagnose.refit import Trial, fine_enough
from rhythmid.diagnose.result import (
    Alternative,
    Detection,
    Diagnosis,
    Estimate,
    FitQuality,
    Location,
    MissingEffect,
    Remainder,
    Verdict,
)
from rhythmid.diagnose.screen import trajectories
from rhythmid.diagnose.search import LEVEL, WORTH, Search, search
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, start_only
from rhythmid.identify.repeats import noise_from_repeats
from rhythmid.identify.series import Series, dominant_frequency, hold_out_tail, prepare
from rhythmid.model import Model
from rhythmid.parallel import cores
from rhythmid.record.record import Record

Array = NDArray[np.float64]
Tell = Callable[[str], None]
TWINS = 2  # a family of this many is an answer; a larger one is undecided
SHOWN = 8  # alternatives listed
REMAINDER_LEVEL = 1e-6
PERIODS = 4  # of the dominant motion, below which a record says nothing


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
    """A diagnosis, the augmented model and the evidence."""

    diagnosis: Diagnosis
    model: Model
    evidence: Evidence


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
    known = catalogue or load_catalogue()
    everything = prepare([*records, *holdout])
    check_comparable(everything)
    count = len(records)
    if holdout:
        seen, unseen = everything[:count], everything[count:]
        heldout = f"held out: {', '.join(one.name for one in unseen)}"
    else:
        seen, unseen = hold_out_tail(everything[:count])
        heldout = "held out: the last fifth of every record"
    # the matrices are tall and thin, and workers run side by side: threads inside linear algebra only get in the way
    with threadpool_limits(1), ThreadPoolExecutor(cores()) as pool:
        calibration = calibrate(model, seen, known, pool, tell)
        seen = list(calibration.series)
        found = search(seen, calibration.fit, known, pool, tell)
        tell("locating the mismatch")
        before = dependences(trajectories(found.nominal), pool)
        after = dependences(trajectories(found.fit), pool) if found.best.added else before
        tell("judging on held-out records")
        judge = _Judge(found, unseen if holdout else None)
        diagnosis = _conclude(model, found, calibration, before, after, judge, heldout)
        nominal_run, augmented_run = judge.fit(found.nominal.model), judge.fit(found.fit.model)
    evidence = Evidence(
        tuple(seen), tuple(unseen), calibration, found, tuple(before), tuple(after), nominal_run, augmented_run
    )
    return Answer(diagnosis, found.fit.model, evidence)


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
            if jump > 300.0 * size or max(spread[i], spread[j]) > 2000.0 * min(spread[i], spread[j]):
                raise InputError(
                    f"{series[j].name} and {one.name} do not look like one machine in one unit (outputs "
                    f"{level[j]:.3g} ± {spread[j]:.3g} and {level[i]:.3g} ± {spread[i]:.3g}); check units and files"
                )


class _Judge:
    """Errors of models on what their fit never saw: separate records, or the hidden end of the same ones."""

    def __init__(self, found: Search, separate: Sequence[Series] | None) -> None:
        self._found, self._separate = found, separate
        self._fits: dict[int, Fit | None] = {}

    def fit(self, model: Model) -> Fit | None:
        """Free run over separate held-out records, only their initial states estimated; None where there are none."""
        if self._separate is None:
            return None
        if id(model) not in self._fits:
            step = fine_enough(model, self._found.fit.run.max_step)
            try:
                self._fits[id(model)] = start_only(model, self._separate, self._found.noise, step)
            except InputError:
                self._fits[id(model)] = None
        return self._fits[id(model)]

    def nrmse(self, model: Model, own: Fit | None = None) -> float | None:
        """Held-out error of a model; `own` is its fit, needed when the held-out part is the end of the same records."""
        if self._separate is not None:
            fit = self.fit(model)
            return None if fit is None else fit.nrmse()
        if own is None:
            return None
        value = own.nrmse(unused=True)
        return None if math.isnan(value) else value


def _tail_error(found: Search, trial: Trial) -> float | None:
    """Held-out error of a trial at the hidden end of its own records."""
    run = prepare_run(trial.model, found.fit.run.series, fine_enough(trial.model, found.fit.run.max_step))
    outputs = run.outputs(trial.model, trial.starts)
    if outputs is None:
        return None
    error, spread = 0.0, 0.0
    for output, one in zip(outputs, run.series):
        measured = one.averaged
        error += float(np.sum((output - measured)[~one.used] ** 2))
        spread += float(np.sum((measured[~one.used] - measured.mean()) ** 2))
    return math.sqrt(error / spread) if spread > 0 else None


def _floor(found: Search, series: Sequence[Series], noise: NoiseModel) -> float:
    joined = np.concatenate([one.averaged[one.used] - one.averaged.mean() for one in series])
    return math.sqrt(noise.variance) / max(float(np.sqrt(np.mean(joined**2))), 1e-300)


def _significant(dependence: Dependence) -> bool:
    return dependence.p_value < REMAINDER_LEVEL and dependence.explained > 0.05


def _conclude(
    nominal: Model,
    found: Search,
    calibration: Calibration,
    before: Sequence[Dependence],
    after: Sequence[Dependence],
    judge: _Judge,
    heldout: str,
) -> Diagnosis:
    """Put the verdict and its reasons together."""
    series = found.fit.run.series
    repeats = noise_from_repeats(list(series))
    p_value = found.rounds[0].p_value
    remains = [d for d in after if _significant(d)]
    rivals = [t for t in found.trials if len(t.added) == len(found.best.added) and t.bic() - found.best.bic() < WORTH]
    twins = _twins(found.best, rivals)
    verdict, reason = _verdict(found, p_value, remains, twins, repeats, series)
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
    location = _location(found, missing, before, verdict)
    experiment = next_experiment(found, rivals, series, verdict)
    augmented = FitQuality(found.fit.nrmse(), judge.nrmse(found.fit.model, found.fit))
    plain = FitQuality(found.nominal.nrmse(), judge.nrmse(found.nominal.model, found.nominal))
    shown = [t for t in found.trials if set(t.added) != set(best.added)][:SHOWN]
    alternatives = tuple(
        Alternative(
            tuple(_element_of(t, label) for label in t.added),
            t.bic() - best.bic(),
            judge.nrmse(t.model) if judge.fit(t.model) is not None else _tail_error(found, t),
        )
        for t in shown
    )
    remainder = None
    if remains:
        top = max(remains, key=lambda d: d.gain)
        remainder = Remainder(
            top.quantity, top.explained, top.p_value, tuple(map(float, top.grid)), tuple(map(float, top.force))
        )
    detection = Detection(p_value, _nominal_error(nominal, found), plain.train_nrmse, _floor(found, series, repeats or found.noise))
    return Diagnosis(
        verdict=verdict,
        summary=_summary(verdict, reason, missing, plain, augmented, twins),
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
        calibration=(*calibration.notes, *_calibrated(nominal, found.fit)),
        excluded=tuple(f"{' + '.join(added)}: {why}" for added, why in found.excluded),
        heldout=heldout,
        remainder=remainder,
    )


def _element_of(trial: Trial, label: str) -> str:
    term = trial.model.term(label)
    assert term is not None
    return term.element.name


def _estimate(fit: Fit, name: str) -> Estimate:
    value = fit.model.parameters[name]
    std = fit.std.get(name)
    if std is not None and (not math.isfinite(std) or std > 1e9 * max(abs(value.value), 1e-12)):
        std = None
    return Estimate(value.value, 0.0 if name not in fit.names else std, value.unit)


def _twins(best: Trial, rivals: Sequence[Trial]) -> list[tuple[str, ...]]:
    """Families within which the records cannot tell: elements that replace one another in equally good models."""
    groups: list[tuple[str, ...]] = []
    for label in best.added:
        others = []
        for rival in rivals:
            gone = set(best.added) - set(rival.added)
            come = set(rival.added) - set(best.added)
            if gone == {label} and len(come) == 1:
                other = _element_of(rival, come.pop())
                if not _contains(best, label, other):
                    others.append(other)
        if others:
            groups.append((_element_of(best, label), *others))
    return groups


def _contains(best: Trial, label: str, other: str) -> bool:
    """Whether `other` is a richer element that has the chosen one as a special case: never to be told from it, and no rival."""
    term = best.model.term(label)
    return term is not None and other in term.element.special_case_of


def _verdict(
    found: Search,
    p_value: float,
    remains: Sequence[Dependence],
    twins: Sequence[tuple[str, ...]],
    repeats: NoiseModel | None,
    series: Sequence[Series],
) -> tuple[Verdict, str]:
    fit = found.fit
    too_big = False
    if repeats is not None and repeats.variance > 0:
        residual = np.concatenate([r[one.used] for r, one in zip(fit.residuals, series)])
        ratio = float(np.mean(residual**2)) / repeats.variance
        colour = max(repeats.long_run_variance / repeats.variance, 1.0)
        too_big = ratio > 1.1 + 6.0 * math.sqrt(2.0 * colour / len(residual))
    if not found.best.added:
        if too_big and remains:
            return "unknown_physics", "no element of the catalogue explains what the nominal model leaves"
        if remains and remains[0].explained > 0.2 and p_value < LEVEL:
            return "unknown_physics", "no element of the catalogue explains what the nominal model leaves"
        if p_value < LEVEL:
            return "undecided", "something is there, but too faint for any element to be worth its parameters"
        if _weak(series):
            return "undecided", "the records are too short or too quiet to exclude anything of interest"
        return "consistent", ""
    improvement = found.nominal.chi2 - fit.chi2
    leftover = max((d.gain for d in remains), default=0.0)
    if too_big or leftover > 0.1 * max(improvement, 1.0):
        return "unknown_physics", "the best elements of the catalogue leave a structured remainder"
    if any(len(group) > TWINS for group in twins):
        return "undecided", "several effects explain the records equally well"
    return "missing_physics", ""


def _weak(series: Sequence[Series]) -> bool:
    """Records that hold fewer than a few periods of motion."""
    return all((one.time[-1] - one.time[0]) * dominant_frequency(one) < PERIODS for one in series)


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


def _calibrated(nominal: Model, fit: Fit) -> list[str]:
    """Nominal parameters that the records contradict, as sentences."""
    said = []
    for name, value in nominal.parameters.items():
        if name not in fit.names:
            continue
        new, std = fit.model.value(name), fit.std[name]
        if math.isfinite(std) and abs(new - value.value) > max(4.0 * std, 0.02 * abs(value.value)):
            said.append(f"{name}: {value.value:.6g} in the nominal model, {new:.6g} ± {std:.2g} {value.unit} in the records")
    return said


SENTENCES = {
    "command": "between the command u and the point where the forcing joins it",
    "actuator": "in the actuator, which turns forcing plus command into force",
    "force": "in the balance of forces on the mass",
    "sensor": "between the mass and the measurement",
    "timing": "in the clocks: stamps and delays that change",
}


def _location(
    found: Search, missing: Sequence[MissingEffect], before: Sequence[Dependence], verdict: Verdict
) -> Location:
    by_slot: dict[str, float] = {}
    for one in found.rounds[0].scores:
        by_slot[one.element.slot] = max(by_slot.get(one.element.slot, 0.0), one.statistic)
    evidence = [
        f"best score in slot {slot}: chi2 = {value:.0f}" for slot, value in sorted(by_slot.items(), key=lambda x: -x[1])
    ]
    evidence += [
        f"a free function of {d.quantity} explains {100 * max(d.explained, 0.0):.0f} % of the mismatch in blocks left out"
        for d in before
    ]
    if verdict == "consistent":
        return Location(None, "nowhere: the refitted nominal model explains the records", tuple(evidence))
    if missing:
        slots = list(dict.fromkeys(effect.slot for effect in missing))
        where = "; and ".join(SENTENCES[slot] for slot in slots)
        return Location(slots[0], where, tuple(evidence))
    best = max(by_slot, key=lambda slot: by_slot[slot], default=None)
    top = before[0] if before else None
    where = SENTENCES.get(best or "", "not located")
    if top is not None and top.explained > 0.2:
        where += f"; it varies with {top.quantity}"
    return Location(best, where, tuple(evidence))


def _summary(
    verdict: Verdict,
    reason: str,
    missing: Sequence[MissingEffect],
    plain: FitQuality,
    augmented: FitQuality,
    twins: Sequence[tuple[str, ...]],
) -> str:
    if verdict == "consistent":
        return "Nothing is missing: with its parameters refitted, the nominal model explains the records down to the noise."
    names = " and ".join(effect.element.replace("_", " ") for effect in missing)
    if verdict == "missing_physics":
        said = f"The model lacks {names}."
        if twins:
            said = f"The model lacks {names} (or, indistinguishable here, {', '.join(' / '.join(g[1:]) for g in twins)})."
        before, after = plain.heldout_nrmse, augmented.heldout_nrmse
        if before is not None and after is not None:
            said += f" With it, the error on held-out data falls from {100 * before:.2f} % to {100 * after:.2f} % of the motion."
        return said
    if verdict == "undecided":
        return f"Undecided: {reason}." + (f" Best so far: {names}." if names else "")
    return f"Something is missing that the catalogue does not know: {reason}." + (
        f" The nearest, not the name: {names}." if names else ""
    )
