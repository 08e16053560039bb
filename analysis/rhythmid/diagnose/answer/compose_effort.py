"""Compose the answer from the results of effort scoring."""

import math
from collections.abc import Sequence
from dataclasses import replace

from rhythmid.diagnose.answer.command_path import equivalents_in_command_path, with_equivalents
from rhythmid.diagnose.answer.compose import explanations, held_out_words, missing_effects, remainder_of
from rhythmid.diagnose.answer.result import Detection, Diagnosis, Estimate, FitQuality, Scored, settled
from rhythmid.diagnose.answer.same_while_moving import same_while_moving
from rhythmid.diagnose.answer.varied_motion import motion_varying
from rhythmid.diagnose.answer.wording import (
    freed_value,
    listed,
    location_of,
    longer_delay,
    recalibrated,
    summary_of,
)
from rhythmid.diagnose.case import Case, Untried
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.found_delay import delay_told, found_delay
from rhythmid.diagnose.effort.run import EffortResult
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.diagnose.verdict_rules import LONGER_DELAY
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import variation_of
from rhythmid.record.separate_zeros import separate_zeros_notes

NO_SENSOR = "The measurement is assumed to be the motion: effects in the sensor and in the measurement's time are not among the candidates."
SAME_HERE = "it acts on the recorded command, beside which nothing drives, as the actuator's law does"
FIXED_SCALE = "The recorded effort is taken to be true in scale."


def compose_effort(case: Case, result: EffortResult, notes: Sequence[str]) -> Diagnosis:
    """The diagnosis."""
    chosen, nominal = result.chosen, result.nominal
    alike = equivalents_in_command_path(case.records, case.nominal, case.catalogue)
    decision = replace(
        result.decision, equivalent=with_equivalents(result.decision.equivalent, result.decision.named, alike)
    )
    size = variation_of(result.search.balance)
    sizes = scales_of(result.search.balance, chosen.fit.model)
    missing = missing_effects(chosen.fit.model, decision, lambda name: _estimate(chosen, name), sizes)
    before, after = (
        FitQuality(one.fit.error / size, result.errors[one.key] / size) for one in (nominal, chosen)
    )
    late = found_delay(result.search.balance, chosen)
    freed = freed_value(case.nominal, chosen.fit.model, result.selection.chosen) or longer_delay(
        late.value, late.std, decision
    )
    remainder = remainder_of(decision, {one.quantity: (one.value, one.mean) for one in result.remainder})
    unknown = decision.verdict == "unknown_physics"
    depends = f"; it depends on {remainder.goes_with}" if unknown and remainder.goes_with is not None else ""
    slot, evidence = "force" if unknown else None, (result.applicability.reason,)
    # held-out records without an effort cannot judge a hypothesis
    unseen = result.heldout is not None
    held = held_out_words(case.holdout, "") if unseen else "held out: every block of the records in its turn"
    return Diagnosis(
        verdict=decision.verdict,
        summary=summary_of(decision, missing, before, after, "effort", freed, noise_known=False),
        detection=Detection(None, None, before.train_nrmse, after.train_nrmse),
        location=location_of(missing, decision.verdict, "effort", evidence, slot, depends),
        missing=missing,
        joint_probability=decision.joint,
        indistinguishable=decision.equivalent,
        alternatives=(),
        hypotheses=explanations(result.contest, decision),
        rejections=result.selection.rejections,
        remainder=remainder,
        fit={"refitted_nominal": before, "augmented": after},
        parameters=effort_parameters(chosen),
        delays=effort_delays(result.search.balance, chosen),
        next_experiment=_next_experiment(result),
        chosen=result.selection.chosen.elements,
        families=decision.families,
        scoring=Scored("effort", result.applicability.bandwidth, result.applicability.reason, 1),
        assumptions=(FIXED_SCALE, NO_SENSOR),
        calibration=(
            *recalibrated(case.nominal, chosen.fit.model, chosen.std()),
            *delay_told(result.search.balance, chosen, case.nominal),
        ),
        excluded=tuple(
            Untried(name, SAME_HERE if name in alike.values() else why)
            for name, why in result.search.not_tried.items()
        ),
        heldout=held,
        notes=(
            *notes,
            *separate_zeros_notes((*case.records[:1], *case.holdout)),
            *(said for label in decision.named for said in same_while_moving(chosen.fit.model.term(label))),
        ),
    )


def _estimate(fitted: Fitted, name: str) -> Estimate:
    """A parameter; standard deviation 0 where it is fixed, None where the effort does not determine it."""
    value = fitted.model.parameters[name]
    std = 0.0 if value.fixed else fitted.std().get(name)
    return Estimate(value.value, std if std is None or math.isfinite(std) else None, value.unit)


def effort_parameters(fitted: Fitted) -> dict[str, Estimate]:
    """All parameters of a fit, by name."""
    return {name: _estimate(fitted, name) for name in fitted.model.parameters}


def effort_delays(balance: Balance, fitted: Fitted) -> dict:
    """The time offset between effort and motion: the only delay that the effort shows."""
    found = found_delay(balance, fitted)
    late = {"value": found.value, "std": found.std, "unit": "s"}
    return {
        "input": {},
        "measurement": {},
        "sum": late,
        "separable": False,
        "assumption": "of the delays only how much later than the effort the motion is recorded shows",
    }


def _next_experiment(result: EffortResult) -> str:
    """What to record next."""
    decision = result.decision
    if settled(decision.verdict, decision.equivalent, bool(decision.beside)) or decision.rule == LONGER_DELAY:
        return (
            "none needed for these records; other speeds, loads and positions would exclude smaller effects"
        )
    if decision.equivalent:
        rivals = "; and ".join(listed(group) for group in decision.equivalent)
        return f"several speeds in both directions, slow reversals and another load: what separates {rivals}"
    if decision.verdict == "missing_physics":
        return f"a longer record of more varied motion: what would establish {listed(decision.beside)}, or rule it out"
    left = decision.unexplained
    if left.further:
        return f"a longer record of more varied motion: what would establish {listed(left.further)}, or rule it out"
    if left.significant and left.goes_with is not None:
        return motion_varying(left.goes_with)
    return "motion with more varied speed, load and position"
