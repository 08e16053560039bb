"""An answer put together from what a free run, or windows, have shown."""

import math
from collections.abc import Sequence

from rhythmid.diagnose.answer.next_experiment import next_experiment
from rhythmid.diagnose.answer.result import (
    Alternative,
    Curve,
    Detection,
    Diagnosis,
    Estimate,
    Explanation,
    FitQuality,
    MissingEffect,
    Remainder,
    Scored,
    Untried,
)
from rhythmid.diagnose.answer.wording import freed_value, location_of, recalibrated, summary_of
from rhythmid.diagnose.case import EXPLAINED, Case
from rhythmid.diagnose.delays import delays_of
from rhythmid.diagnose.evidence import difference
from rhythmid.diagnose.free_run import FreeRunResult
from rhythmid.diagnose.location import Dependence
from rhythmid.diagnose.selection import Contest
from rhythmid.diagnose.verdict import Decision
from rhythmid.errors import InputError
from rhythmid.identify.held_out_zeros import held_out_zero_notes
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, start_only
from rhythmid.identify.repeats import noise_from_repeats
from rhythmid.identify.series import Series
from rhythmid.identify.zero_estimates import zeros_told
from rhythmid.model import Model

SHOWN = 8  # alternatives listed
ONE_CLOCK = "The clocks of command and measurement agree: an offset between them counts as delay."
MORE_TIME = "none computed in the time given; a larger --budget tells which experiment separates best"
RIVALS = 10.0  # difference of the information criterion within which a rival is worth an experiment


def explanations(contest: Contest, decision: Decision) -> tuple[Explanation, ...]:
    """All hypotheses as the answer lists them, the best first."""
    ranked = sorted((*contest.hypotheses, *contest.ruled_out), key=lambda one: -one.prediction.score)
    best = ranked[0].prediction
    found = []
    for one in ranked:
        gain, error = difference(best, one.prediction)
        found.append(
            Explanation(
                one.names,
                one.kind,
                one.prediction.score,
                gain,
                error,
                decision.weights.get(one.key, 0.0),
                one.heldout_nrmse,
            )
        )
    return tuple(found)


def compose(case: Case, result: FreeRunResult, notes: Sequence[str]) -> Diagnosis:
    """The diagnosis."""
    found, decision, contest = result.search, result.decision, result.contest
    series = found.fit.run.series
    repeats = noise_from_repeats(list(series))
    best = found.best
    missing = tuple(
        _missing(found.fit, label, decision) for label in decision.named if best.model.term(label)
    )
    plain = FitQuality(found.nominal.nrmse(), contest.nominal.heldout_nrmse)
    augmented = FitQuality(found.fit.nrmse(), result.selection.chosen.heldout_nrmse)
    rivals = [t for t in found.trials if len(t.added) == len(best.added) and t.bic() - best.bic() < RIVALS]
    heldout = {tuple(sorted(one.elements)): one.heldout_nrmse for one in contest.hypotheses}
    alternatives = tuple(
        Alternative(
            tuple(t.element(label).name for label in t.added),
            t.bic() - best.bic(),
            heldout.get(tuple(sorted(t.added))),
        )
        for t in [t for t in found.trials if set(t.added) != set(best.added)][:SHOWN]
    )
    fit = found.fit
    if case.holdout:
        held = f"held out: {', '.join(dict.fromkeys(record.whole or record.name for record in case.holdout))}"
    else:
        held = (
            f"held out: the last fifth of every {'record' if result.scoring.kind == 'free_run' else 'window'}"
        )
    return Diagnosis(
        verdict=decision.verdict,
        summary=summary_of(decision, missing, plain, augmented, "motion", _freed(case.nominal, result)),
        detection=Detection(
            found.rounds[0].p_value,
            _nominal_error(case.nominal, found.nominal, found.noise),
            plain.train_nrmse,
            _floor(series, [found.noise, *([repeats] if repeats is not None else [])]),
        ),
        location=location_of(found, missing, result.before, decision.verdict),
        missing=missing,
        joint_probability=decision.joint,
        indistinguishable=_indistinguishable(found.fit.model, decision),
        alternatives=alternatives,
        hypotheses=explanations(contest, decision),
        rejections=result.selection.rejections,
        remainder=_remainder(decision, result.after),
        fit={"refitted_nominal": plain, "augmented": augmented},
        parameters={name: estimated(fit, name) for name in fit.model.parameters},
        delays=delays_of(fit),
        next_experiment=(
            MORE_TIME
            if case.budget.passed(EXPLAINED)
            else next_experiment(found, rivals, series, decision.verdict)
        ),
        scoring=Scored(result.scoring.kind, None, result.scoring.reason),
        calibration=(
            *result.calibration.notes,
            *zeros_told(fit),
            *recalibrated(case.nominal, fit.model, {name: fit.std[name] for name in fit.names}),
        ),
        excluded=tuple(Untried(" + ".join(added), why) for added, why in found.excluded),
        heldout=held,
        notes=(
            *notes,
            *held_out_zero_notes(fit, result.unseen if case.holdout and not case.budget.spent else ()),
        ),
        chosen=result.selection.chosen.elements,
        families=decision.families,
        assumptions=(ONE_CLOCK,) if any(one.commanded for one in series) else (),
    )


def _indistinguishable(model: Model, decision: Decision) -> tuple[tuple[str, ...], ...]:
    """Groups of names that these records cannot separate: those that the evidence does not, and those that make one model."""
    groups = list(decision.equivalent)
    for label in decision.named:
        term = model.term(label)
        if term is None:
            continue
        same = [*term.element.same_as]
        same += [other for beside, other in term.element.same_beside.items() if _estimated(model, beside)]
        if same:
            groups.append((term.element.name, *same))
    return tuple(groups)


def _estimated(model: Model, name: str) -> bool:
    """Whether the model has the named element, with parameters that are not all known."""
    return any(t.element.name == name and not all(v.fixed for v in t.values.values()) for t in model.terms)


def _freed(nominal: Model, result: FreeRunResult) -> str | None:
    """A sentence about the fixed value that the chosen hypothesis frees; None where it frees none."""
    chosen = result.selection.chosen
    if chosen.kind != "freed_value":
        return None
    return freed_value(nominal, result.search.fit.model, chosen.elements)


def _missing(fit: Fit, label: str, decision: Decision) -> MissingEffect:
    term = fit.model.term(label)
    assert term is not None
    return MissingEffect(
        term.element.name,
        term.element.slot,
        term.element.equation,
        decision.shares[label],
        decision.probability[label],
        {name: estimated(fit, f"{label}.{name}") for name in term.values},
    )


def estimated(fit: Fit, name: str) -> Estimate:
    """A parameter of a fit; standard deviation 0 where it is fixed, None where the records do not determine it."""
    value = fit.model.parameters[name]
    std = fit.std.get(name)
    if std is not None and (not math.isfinite(std) or std > max(1e6 * abs(value.value), 1e-3)):
        std = None
    return Estimate(value.value, 0.0 if name not in fit.names else std, value.unit)


def _remainder(decision: Decision, after: Sequence[Dependence]) -> Remainder:
    left = decision.unexplained
    found = next((one for one in after if one.quantity == left.goes_with), None)
    curve = None
    if found is not None and len(found.force):
        curve = Curve(tuple(map(float, found.grid)), tuple(map(float, found.force)))
    return Remainder(left.share, left.significant, left.goes_with, curve)


def _floor(series: Sequence[Series], noises: Sequence[NoiseModel]) -> float:
    """Error that noise alone leaves. Repeats that still ring down overstate it, and a fit that is good enough shows less."""
    variance = min(noise.variance for noise in noises)
    power = sum(one.power(one.used) for one in series) / max(sum(int(one.used.sum()) for one in series), 1)
    return math.sqrt(variance / max(power, 1e-300))


def _nominal_error(nominal: Model, fit: Fit, noise: NoiseModel) -> float | None:
    """Error of the nominal model exactly as given, its initial states fitted; None where it diverges."""
    values = {name: value.value for name, value in nominal.parameters.items() if name in fit.model.parameters}
    try:
        again = start_only(fit.model.with_values(values), fit.run.series, noise, fit.run.max_step)
    except InputError:
        return None
    return again.nrmse()
