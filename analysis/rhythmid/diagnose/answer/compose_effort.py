"""Compose the answer from the results of effort scoring."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from rhythmid.diagnose.answer.compose import explanations, held_out_words, missing_effects, remainder_of
from rhythmid.diagnose.answer.effect_notes import same_while_moving
from rhythmid.diagnose.answer.result import Detection, Diagnosis, Estimate, FitQuality, Scored, settled
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
from rhythmid.diagnose.effort.reference import HISTORY
from rhythmid.diagnose.effort.remainder import SPEED_OF
from rhythmid.diagnose.effort.run import EffortResult
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.diagnose.verdict_rules import LONGER_DELAY
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import variation_of
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.record.separate_zeros import separate_zeros_notes

NO_SENSOR = "The measurement is assumed to be the motion: effects in the sensor and in the measurement's time are not among the candidates."
SAME_HERE = "it acts on the recorded command, beside which nothing drives, as the actuator's law does"
FIXED_SCALE = "The recorded effort is taken to be true in scale."
# the motion to record next, by the quantity on which the rest depends: it varies over its whole range, and the others stay, so that none stands for it
MOTIONS = {
    "velocity": "constant speeds from the slowest to the fastest, in both directions, over the same travel and with the same load",
    "position": "one slow constant speed over the whole travel, there and back, with the same load",
    "acceleration": "the same path at several accelerations up to the largest, with the same load",
    "load": "the same motion with several loads, from none to the largest",
    "time": "the same short motion from a cold start, repeated until the effort no longer changes",
    HISTORY: "reversals after short and after long strokes, at a slow and at a fast speed, with the same load",
}
Groups = tuple[tuple[str, ...], ...]


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
    held = "held out: every block of the records in its turn"
    if result.heldout is not None:  # held-out records without an effort cannot judge a hypothesis
        # of the joint of a body only the balance is given
        names = dict.fromkeys(motion.name for motion in result.heldout.motions)
        held = held_out_words(case.holdout, ", ".join(names))
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


def motion_varying(quantity: str) -> str:
    """The motion that varies the quantity of a remaining effort, as `remainder_of` or a map names it, and why."""
    if quantity.startswith(SPEED_OF):
        other = quantity.removeprefix(SPEED_OF)
        motion = f"{other} moved alone at several constant speeds while this joint is held"
    else:
        motion = MOTIONS[quantity]
    return f"{motion}: the effort that is left depends on {quantity}"


def equivalents_in_command_path(
    records: Sequence[Record], model: Model, catalogue: Catalogue
) -> Mapping[str, str]:
    """The element of the command path that does here what one of the actuator does, by the name of that one.

    A lag of the command and one of the actuator differ in what else drives: a forcing on the robot passes through the actuator
    alone. Where nothing else drives, they are one law. An effort that was measured has the command path behind it, and shows nothing of it.
    Two elements do the same where they share a kernel.
    """
    commanded = all(
        one.input is not None and one.hold == "zero" and one.effort is None and one.forcing is None
        for one in records
    )
    if not commanded or controlled(model):
        return {}
    of_command = {one.kernel: one.name for one in catalogue.values() if one.slot == "command" and one.kernel}
    return {
        one.name: of_command[one.kernel]
        for one in catalogue.values()
        if one.slot == "actuator" and one.kernel is not None and one.kernel in of_command
    }


def with_equivalents(groups: Groups, named: Sequence[str], equivalents: Mapping[str, str]) -> Groups:
    """The groups of indistinguishable laws, with the equivalents of those that are named."""
    found = [(*group, *(equivalents[name] for name in group if name in equivalents)) for group in groups]
    alone = [name for name in named if name in equivalents and not any(name in group for group in groups)]
    return (*found, *((name, equivalents[name]) for name in alone))
