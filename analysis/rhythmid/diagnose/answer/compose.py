"""Compose the answer from the results of a free run or of windows."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.answer.effect_notes import own_sizes, same_while_moving
from rhythmid.diagnose.answer.next_experiment import next_experiment
from rhythmid.diagnose.answer.result import (
    Alternative,
    Curve,
    Detection,
    Diagnosis,
    Estimate,
    Explanation,
    FitQuality,
    Location,
    MissingEffect,
    Remainder,
    Scored,
    settled,
)
from rhythmid.diagnose.answer.wording import (
    freed_value,
    location_of,
    longer_delay,
    recalibrated,
    summary_of,
    unstated_delay,
)
from rhythmid.diagnose.case import EXPLAINED, Case
from rhythmid.diagnose.delays import delays_of
from rhythmid.diagnose.evidence import difference
from rhythmid.diagnose.free_run import FreeRunResult
from rhythmid.diagnose.hypothesis import Verdict
from rhythmid.diagnose.location import Dependence
from rhythmid.diagnose.reference_scale import scale_told
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.proposals import WORTH
from rhythmid.diagnose.search.trial import Trial
from rhythmid.diagnose.selection import Contest
from rhythmid.diagnose.verdict import Decision
from rhythmid.diagnose.verdict_rules import LONGER_DELAY
from rhythmid.elements.element import Element, Scales
from rhythmid.identify.held_out_zeros import held_out_zero_notes
from rhythmid.identify.natural_size import is_told, natural_size
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, rerun
from rhythmid.identify.record_scales import scales
from rhythmid.identify.repeats import noise_from_repeats
from rhythmid.identify.series import Series
from rhythmid.identify.zero_estimates import zeros_told
from rhythmid.model import Model, Term
from rhythmid.record.record import Record
from rhythmid.simulation.transport import INPUT_DELAY

Array = NDArray[np.float64]
SHOWN = 8  # alternatives listed
VARIES = 0.2  # share of the mismatch from which a free function of a quantity is told with its location
ONE_CLOCK = "The clocks of command and measurement agree: an offset between them counts as delay."
MORE_TIME = (
    "not computed in the time given; with a larger --budget the answer says which experiment separates best"
)


def explanations(contest: Contest, decision: Decision) -> tuple[Explanation, ...]:
    """All hypotheses in the form that the answer lists, best first."""
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
    fit, chosen = found.fit, result.selection.chosen
    series = fit.run.series
    missing = missing_effects(
        fit.model, decision, lambda name: estimated(fit, name), scales(series, fit.model)
    )
    plain = FitQuality(found.nominal.nrmse(), contest.nominal.heldout_nrmse)
    augmented = FitQuality(fit.nrmse(), chosen.heldout_nrmse)
    groups = _indistinguishable(fit.model, decision)
    case.tell("choosing the next experiment")
    part = "record" if result.scoring.kind == "free_run" else "window"
    drawn = {one.quantity: (one.grid, one.force) for one in result.after}
    return Diagnosis(
        verdict=decision.verdict,
        summary=summary_of(decision, missing, plain, augmented, "motion", _freed(case.nominal, result)),
        detection=Detection(
            found.rounds[0].p_value,
            _nominal_error(case.nominal, found.nominal, found.noise),
            plain.train_nrmse,
            _floor(series, found.noise),
        ),
        location=_location(found, missing, result.before, decision.verdict),
        missing=missing,
        joint_probability=decision.joint,
        indistinguishable=groups,
        alternatives=_alternatives(found, contest),
        hypotheses=explanations(contest, decision),
        rejections=result.selection.rejections,
        remainder=remainder_of(decision, drawn),
        fit={"refitted_nominal": plain, "augmented": augmented},
        parameters={name: estimated(fit, name) for name in fit.model.parameters},
        delays=delays_of(fit),
        next_experiment=MORE_TIME if case.budget.passed(EXPLAINED) else _next(found, decision, groups),
        scoring=Scored(result.scoring.kind, None, result.scoring.reason, series[0].block),
        calibration=(*result.calibration.notes, *_recalibrated(case.nominal, fit)),
        excluded=found.excluded,
        heldout=held_out_words(case.holdout, f"the last fifth of every {part}"),
        notes=(
            *notes,
            *own_sizes(decision, fit, result.size_errors),
            *(said for label in decision.named for said in same_while_moving(fit.model.term(label))),
            *held_out_zero_notes(
                fit, result.scoring.unseen if case.holdout and not case.budget.spent else ()
            ),
        ),
        chosen=chosen.elements,
        families=decision.families,
        assumptions=(ONE_CLOCK,) if any(one.commanded for one in series) else (),
    )


def _alternatives(found: Search, contest: Contest) -> tuple[Alternative, ...]:
    """The models that fit best, without the chosen one."""
    heldout = {one.key: one.heldout_nrmse for one in contest.hypotheses}
    others = [one for one in found.trials if one.key != found.best.key]
    return tuple(
        Alternative(one.names, one.bic() - found.best.bic(), heldout.get(one.key)) for one in others[:SHOWN]
    )


def _next(found: Search, decision: Decision, groups: tuple[tuple[str, ...], ...]) -> str:
    """The experiment that separates the models that the records do not."""
    best = found.best
    rivals = [one for one in found.trials if _rivals(one, best, groups)]
    if decision.beside and not any(one.key != best.key for one in rivals):
        rivals = [one for one in found.trials if _without(one, best, decision.beside)]
    settles = settled(decision.verdict, groups, bool(decision.beside)) or decision.rule == LONGER_DELAY
    needed = decision.verdict != "consistent" and not settles
    return next_experiment(found, rivals, found.fit.run.series, needed)


def _location(
    found: Search, missing: Sequence[MissingEffect], before: Sequence[Dependence], verdict: Verdict
) -> Location:
    """Where the mismatch is; without named effects, the slot of the element that scored best."""
    by_slot: dict[str, float] = {}
    for one in found.rounds[0].scores:
        by_slot[one.element.slot] = max(by_slot.get(one.element.slot, 0.0), one.statistic)
    ranked = sorted(by_slot.items(), key=lambda pair: -pair[1])
    evidence = [f"best score in slot {slot}: chi2 = {value:.0f}" for slot, value in ranked]
    evidence += [
        f"a free function of {one.quantity} explains {100 * max(one.explained, 0.0):.0f} % of the mismatch in blocks left out"
        for one in before
    ]
    shown = before and before[0].explained > VARIES
    depends = f"; it varies with {before[0].quantity}" if shown else ""
    return location_of(missing, verdict, "records", evidence, ranked[0][0] if ranked else None, depends)


def _rivals(one: Trial, best: Trial, groups: Sequence[Sequence[str]]) -> bool:
    """Whether the records do not tell a trial from the best one: by the information criterion or by the evidence."""
    if len(one.added) == len(best.added) and one.bic() - best.bic() < WORTH:
        return True
    names, own = (set(t.names) for t in (one, best))
    return names != own and any(names ^ own <= set(group) for group in groups)


def _without(one: Trial, best: Trial, uncertain: Sequence[str]) -> bool:
    """Whether a trial is the best one without some effects that are too uncertain to be named, or with others in their place."""
    gone = set(best.names) - set(one.names)
    return bool(gone) and gone <= set(uncertain) and len(one.added) <= len(best.added)


def _freed(nominal: Model, result: FreeRunResult) -> str | None:
    """Sentences about the fixed value, or the delay, that the chosen hypothesis frees."""
    fit = result.search.fit
    freed = freed_value(nominal, fit.model, result.selection.chosen)
    if freed or INPUT_DELAY not in fit.names:
        return freed
    return longer_delay(fit.model.value(INPUT_DELAY), fit.std[INPUT_DELAY], result.decision)


def _recalibrated(nominal: Model, fit: Fit) -> tuple[str, ...]:
    """Sentences about zeros, scales and nominal values that the records contradict, and a delay that the model lacks."""
    values = recalibrated(nominal, fit.model, {name: fit.std[name] for name in fit.names})
    told = (*zeros_told(fit), *scale_told(nominal, fit), *values)
    if INPUT_DELAY in nominal.parameters or INPUT_DELAY not in fit.names:
        return told
    return (*told, *unstated_delay(fit.model.value(INPUT_DELAY), fit.std[INPUT_DELAY]))


def _indistinguishable(model: Model, decision: Decision) -> tuple[tuple[str, ...], ...]:
    """Groups of names that these records cannot separate: by the evidence, or because they form one model."""
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


def held_out_words(records: Sequence[Record], otherwise: str) -> str:
    """The names of the held-out records; `otherwise` where there are none."""
    names = dict.fromkeys(record.whole or record.name for record in records)
    return f"held out: {', '.join(names) or otherwise}"


def missing_effects(
    model: Model, decision: Decision, estimate: Callable[[str], Estimate], known: Scales
) -> tuple[MissingEffect, ...]:
    """The named effects of a fitted model, with an `estimate` of each parameter, looked up by its name.

    `known` are the scales of the records.
    """
    return tuple(
        MissingEffect(
            term.element.name,
            term.element.slot,
            term.element.equation,
            decision.shares[label],
            decision.probability[label],
            sizes_told(term, estimate, known),
        )
        for label in decision.named
        if (term := model.term(label)) is not None
    )


def sizes_told(term: Term, estimate: Callable[[str], Estimate], known: Scales) -> dict[str, Estimate]:
    """The estimates of an effect's parameters, looked up by the name "label.parameter"; `known` are the scales of the records."""
    return {name: _told(estimate(f"{term.label}.{name}"), name, term.element, known) for name in term.values}


def _told(found: Estimate, name: str, element: Element, known: Scales) -> Estimate:
    """The estimate of an effect's parameter; its standard deviation is None where the records tell nothing of it.

    An example is the speed over which a dry friction turns. Of the effect's own size, by which it was found, they always tell something.
    """
    usual = natural_size(element.parameter(name).unit, known)
    told = name == element.size or not found.std or is_told(found.value, found.std, usual)
    return found if told else replace(found, std=None)


def estimated(fit: Fit, name: str) -> Estimate:
    """A parameter of a fit; standard deviation 0 where it is fixed, None where the records do not determine it."""
    value = fit.model.parameters[name]
    std = fit.std.get(name)
    if std is not None and (not math.isfinite(std) or std > max(1e6 * abs(value.value), 1e-3)):
        std = None
    return Estimate(value.value, 0.0 if name not in fit.names else std, value.unit)


def remainder_of(decision: Decision, drawn: Mapping[str, tuple[Array, Array]]) -> Remainder:
    """What the names leave unexplained; `drawn` gives its curve by quantity, as (values of the quantity, remainder there)."""
    left = decision.unexplained
    grid, force = drawn.get(left.goes_with or "", ((), ()))
    curve = Curve(tuple(map(float, grid)), tuple(map(float, force))) if len(force) else None
    return Remainder(left.share, left.significant, left.goes_with, curve)


def _floor(series: Sequence[Series], noise: NoiseModel) -> float:
    """Error due to noise alone. Repeats that still ring down overstate it, so that a good enough fit shows less."""
    repeats = noise_from_repeats(series)
    variance = noise.variance if repeats is None else min(noise.variance, repeats.variance)
    power = sum(one.power(one.used) for one in series) / max(sum(int(one.used.sum()) for one in series), 1)
    return math.sqrt(variance / max(power, 1e-300))


def _nominal_error(nominal: Model, fit: Fit, noise: NoiseModel) -> float | None:
    """Error of the nominal model with its given parameters, initial states fitted; None where it diverges."""
    values = {name: value.value for name, value in nominal.parameters.items() if name in fit.model.parameters}
    again = rerun(fit.model.with_values(values), fit.run.series, noise, fit.run.max_step)
    return None if again is None else again.nrmse()
