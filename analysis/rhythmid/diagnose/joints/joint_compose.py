"""Compose the answers of all joints."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import split
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.compose import sizes_told
from rhythmid.diagnose.answer.compose_effort import FIXED_SCALE
from rhythmid.diagnose.answer.effect_notes import same_while_moving
from rhythmid.diagnose.answer.result import Diagnosis, Estimate
from rhythmid.diagnose.constants import BLIND, STATED
from rhythmid.diagnose.effort.scales import scales_of
from rhythmid.diagnose.hypothesis import Verdict
from rhythmid.diagnose.joints.base_tilt import BaseTilt
from rhythmid.diagnose.joints.equivalents import probability_together, shared_among
from rhythmid.diagnose.joints.gear_compliance import GearCompliance
from rhythmid.diagnose.joints.joint_answer import JointEffect, JointLocation, MachineDiagnosis
from rhythmid.diagnose.joints.joint_case import OF_LINKS, JointResult, name_of
from rhythmid.diagnose.joints.row_agreement import agreeing, words_of
from rhythmid.diagnose.joints.wrong_link import WrongLink
from rhythmid.elements.places import SENTENCES
from rhythmid.identify.inverse_dynamics.estimate import size_of
from rhythmid.identify.joints.reference_delay import ReferenceDelay
from rhythmid.model import INERTIA
from rhythmid.report.quantity import in_words, sentence
from rhythmid.simulation.transport import INPUT_DELAY

EQUATIONS = {  # for quantities that are not elements: slot, meaning, and the name of the one parameter
    "armature": ("body", "M_jj → M_jj + ΔI", "inertia_error"),
    "link_mass": ("body", "m → m′, shape kept", "mass"),
    "link_inertia": ("body", "J → J′ about the centre of mass, along the joint's axis", "inertia"),
    "link_centre_of_mass": ("body", "c → c′, mass and inertia about the centre kept", "x, y, z"),
    "link_mass_and_centre": ("body", "m, c, I → m′, c′, I′", "mass, x, y, z"),
    "payload": ("body", "point mass m at the end of the link", "mass"),
    "base_tilt": ("body", "g → g′, its size kept", "angle, x, y, z"),
    "gear_compliance": ("gear", "q → q − τ/k at the link, q at the encoder", "stiffness, compliance"),
    "actuator_delay": ("actuator", "f(t) → f(t − τ)", "delay"),
    "input_delay": ("command", "r(t) → r(t − τ)", "delay"),
}
WHERE = {"gear": "in its gear"}  # slots that no element has
IN_CONTACT = (
    "What was recorded in contact with the ground, or near it, is left out: the contact's force is not known."
)
COMPUTED = "The effort of {} was not recorded; it is what the controller's gains make of the reference."


def compose_machine(
    machine: Machine,
    found: Mapping[str, JointResult],
    answers: Mapping[str, Diagnosis],
    stated: Mapping[str, Sequence[str]],
    links: Mapping[str, WrongLink],
    refused: Mapping[str, str],
    notes: Sequence[str] = (),
    delay: ReferenceDelay | None = None,
    tilt: BaseTilt | None = None,
    gears: Mapping[str, GearCompliance] | None = None,
) -> MachineDiagnosis:
    """The diagnosis; `links` are the corrected masses, inertias or payloads, `tilt` that of the base, `gears` those that yield, `stated` the labels
    stated at each joint."""
    open_ = [
        (joint, label)
        for joint, labels in stated.items()
        for label in labels
        if label.removeprefix(f"{BODY}.") not in links
    ]
    missing = once([_effect(machine, found[joint], answers[joint], label) for joint, label in open_])
    missing += [_link(machine, one, links, answers) for one in links.values()]
    if tilt is not None:
        missing.append(_of_base(tilt, answers[tilt.shown]))
    missing += [_of_gear(one, answers[joint]) for joint, one in (gears or {}).items()]
    of_links = _quantities_of(links)
    holding = [one for one in missing if _holds(one, answers, of_links)]
    missing.sort(key=lambda one: (one not in holding, -one.heldout_gain))
    named = {one.joint for one in missing if one.joint is not None}
    unknown = tuple(j for j, one in answers.items() if one.verdict == "unknown_physics")
    sure = {one.joint for one in holding}
    undecided = tuple(
        j
        for j, one in answers.items()
        if one.verdict == "undecided" and j not in sure and (not stated[j] or j in named)
    )
    own = {joint: one.indistinguishable for joint, one in answers.items() if joint in {*named, *undecided}}
    return MachineDiagnosis(
        verdict=_verdict(bool(sure), bool(unknown), bool(undecided or missing)),
        summary=summary_of_joints(missing, unknown, undecided, answers, of_links, tilt),
        location=_location(missing, unknown, undecided),
        missing=tuple(missing),
        unknown=unknown,
        undecided=undecided,
        indistinguishable=_indistinguishable(machine, own, of_links),
        fit={joint: {str(k): v for k, v in one.fit.items()} for joint, one in answers.items()},
        parameters={
            f"{joint}.{name}": value
            for joint, one in answers.items()
            for name, value in one.parameters.items()
            if not name.startswith(f"{BODY}.") and name != INERTIA
        },
        next_experiment=_next(answers, named, unknown, undecided),
        scoring=next(iter(answers.values())).scoring,
        joints=agreeing(answers, holding, elsewhere_found(machine, open_, holding)),
        not_judged=dict(refused),
        families={joint: one.families for joint, one in answers.items() if one.families},
        assumptions=assumptions_of(machine, found, answers),
        notes=(
            *notes,
            *(
                said
                for joint, label in open_
                for said in same_while_moving(found[joint].result.chosen.fit.model.term(label), f"{joint}.")
            ),
        ),
        reference_delay=delay,
    )


def _verdict(sure: bool, unknown: bool, doubtful: bool) -> Verdict:
    """The verdict on the machine, by whether some effect is sure, the law at some joint is unknown, or anything else is in doubt."""
    if sure:
        return "missing_physics"
    if unknown:
        return "unknown_physics"
    return "undecided" if doubtful else "consistent"


def _indistinguishable(
    machine: Machine, own: Mapping[str, tuple[tuple[str, ...], ...]], of_links: Mapping[str, tuple[str, ...]]
) -> tuple[tuple[str, ...], ...]:
    """Groups of names that the records do not separate: those of joints, and the quantities of links, of which any may be the wrong one."""
    places = [(joint, group) for joint, groups in own.items() for group in groups]
    places += [(machine.body.joint_of(link), names) for link, names in of_links.items() if len(names) > 1]
    return tuple(tuple(f"{joint}: {name}" for name in group) for joint, group in places)


def _effect(machine: Machine, one: JointResult, answer: Diagnosis, label: str) -> JointEffect:
    decision, fitted = one.result.decision, one.result.chosen
    place = split(label.removeprefix(f"{BODY}."))[0] if label.startswith(f"{BODY}.") else None
    gain = _gain(one)
    known = fitted.fit.model.term(label)
    if known is not None:
        scales = scales_of(one.result.search.balance, fitted.fit.model)
        parameters = sizes_told(known, answer.parameters.__getitem__, scales)
        element, slot, equation = known.element.name, known.element.slot, known.element.equation
    else:
        element, _ = name_of(one.joint, label, one.by_reference)
        slot, equation, own = EQUATIONS[element]
        parameters = {own: _value(one, answer, label)}
    return JointEffect(
        one.joint if place is None else machine.body.joint_of(place),
        element,
        slot,
        equation,
        decision.shares[label],
        decision.probability[label] / shared_among(one, label),
        parameters,
        gain,
        place,
        together=probability_together(one, label),
    )


def once(effects: Sequence[JointEffect]) -> list[JointEffect]:
    """The effects, of which a value of a link that several joints show is one: that of the joint that is surest of it."""
    best: dict[tuple[str | None, str], JointEffect] = {}
    for one in effects:
        known = best.get((one.link, one.element))
        if one.link and (known is None or one.probability > known.probability):
            best[one.link, one.element] = one
    return [one for one in effects if not one.link or best[one.link, one.element] is one]


def elsewhere_found(
    machine: Machine, open_: Sequence[tuple[str, str]], holding: Sequence[JointEffect]
) -> dict[str, list[str]]:
    """Joints at which a value of a link was found that another joint moves, with the words for it."""
    sure = {(one.link, one.element): words_of(one) for one in holding if one.link}
    said: dict[str, list[str]] = {}
    for joint, label in open_:
        if not label.startswith(f"{BODY}."):
            continue
        element, link = name_of(joint, label)
        if (link, element) in sure and machine.body.joint_of(link) != joint:
            said.setdefault(joint, []).append(sure[link, element])
    return said


def _value(one: JointResult, answer: Diagnosis, label: str) -> Estimate:
    if label == INPUT_DELAY:
        late = answer.delays["sum"]
        return Estimate(late["value"], late["std"], "s")
    said = answer.parameters[label]
    if label != INERTIA:
        return said
    return Estimate(said.value - one.case.nominal.mass.value, said.std, said.unit)


def _gain(one: JointResult) -> float:
    """Reduction of the error on data that no fit has seen, as a share of the joint's effort."""
    size = size_of(one.result.search.balance)
    before, after = (one.result.errors[fitted.key] for fitted in (one.result.nominal, one.result.chosen))
    return (before - after) / size


def _link(
    machine: Machine, wrong: WrongLink, links: Mapping[str, WrongLink], answers: Mapping[str, Diagnosis]
) -> JointEffect:
    """A link's mass, inertia, centre of mass or payload, with what it explains of the joint that shows it best.

    All corrected values of the link share the probability: together they say that its inertia is not the file's, and leave open in which of its
    ten parameters.
    """
    name, kind = split(wrong.parameter)
    same = sum(split(parameter)[0] == name for parameter in links)
    element = OF_LINKS[kind]
    slot, equation, _ = EQUATIONS[element]
    _, gain = _explained_at(answers[wrong.shown])
    return JointEffect(
        machine.body.joint_of(name), element, slot, equation, wrong.share,
        wrong.probability / (same + len(wrong.alike)), wrong.told(machine.body), gain, name,
        wrong.probability, () if wrong.together is None else wrong.together.links,
    )  # fmt: skip


def _of_base(tilt: BaseTilt, shown: Diagnosis) -> JointEffect:
    """The tilt of the base, with what it explains of the joint that shows it best."""
    slot, equation, _ = EQUATIONS["base_tilt"]
    share, gain = _explained_at(shown)
    return JointEffect(None, "base_tilt", slot, equation, share, tilt.probability, tilt.values, gain)


def _of_gear(gear: GearCompliance, answer: Diagnosis) -> JointEffect:
    """The gear of a joint that yields, with what it explains there."""
    slot, equation, _ = EQUATIONS["gear_compliance"]
    share, gain = _explained_at(answer)
    return JointEffect(
        gear.joint, "gear_compliance", slot, equation, share, gear.probability, gear.values, gain
    )


def _explained_at(answer: Diagnosis) -> tuple[float, float]:
    """Share of a joint's mismatch that is explained, and reduction of its error."""
    before, after = (one.error for one in (answer.refitted_nominal, answer.augmented))
    share = 1.0 - (after / before) ** 2 if before > 0.0 else 0.0
    return max(share, 0.0), max(before - after, 0.0)


def _quantities_of(links: Mapping[str, WrongLink]) -> dict[str, tuple[str, ...]]:
    """For each wrong link its quantities that may be the wrong ones: the corrected ones, and those that explain the records as well."""
    names: dict[str, dict[str, None]] = {}
    for one in links.values():
        link, kind = split(one.parameter)
        names.setdefault(link, {}).update(dict.fromkeys((OF_LINKS[kind], *one.alike)))
    return {link: tuple(found) for link, found in names.items()}


def summary_of_joints(
    missing: Sequence[JointEffect],
    unknown: Sequence[str],
    undecided: Sequence[str],
    answers: Mapping[str, Diagnosis],
    of_links: Mapping[str, Sequence[str]],
    tilt: BaseTilt | None = None,
) -> str:
    """Summary of the joints at which something is wrong; `of_links` are the quantities of each wrong link that may be the wrong ones.

    For joints with unknown physics it names the quantity that the mismatch depends on; for undecided joints, the candidates.
    """
    said, doubted, beside, told = [], [], [], set[str]()
    for one in missing:
        if one.joint is None or (one.link and one.link in told):
            continue
        others = [] if one.probability >= STATED else _in_its_place(one, answers, of_links)
        what = " or ".join([words_of(one), *others])
        if not _holds(one, answers, of_links):
            chance = f"{one.together:.2f} together" if others else f"{one.probability:.2f}"
            (beside if _sure_in_part(one, answers) else doubted).append(
                f"{one.joint}: {what} (probability {chance})"
            )
            continue
        told |= {one.link} if one.link else set()
        said.append(f"{one.joint}: {what}")
    words = "" if tilt is None else sentence(tilt.words)
    words += f" The model is wrong at {'; '.join(said)}." if said else ""
    words += f" Whatever else is wrong there: {'; '.join(beside)}." if beside else ""
    words += f" In doubt: {'; '.join(doubted)}." if doubted else ""
    for why, joints in _alike(unknown, answers).items():
        words += f" At {', '.join(joints)} {why[0].lower()}{why[1:]}"
    for why, joints in _alike(undecided, answers).items():
        words += f" At {', '.join(joints)} the records do not decide: {why}"
    return words.strip() or "Nothing of practical size is missing at any joint."


def _holds(one: JointEffect, answers: Mapping[str, Diagnosis], of_links: Mapping[str, Sequence[str]]) -> bool:
    """Whether an effect is sure enough for the headline: by itself, or with those that are listed in its place.

    If the joint's own answer is undecided, what was fitted there has to explain the effort as an identified model does: what leaves more of it
    may be the best of several wrong explanations. A sure part of an explanation that is not sure as a whole remains in doubt.
    """
    answer = None if one.joint is None else answers.get(one.joint)
    same = of_links.get(one.link, ()) if one.link else ()
    if max(one.probability * max(len(same), 1), one.together) < STATED:
        return False
    if (
        answer is None or answer.verdict == "missing_physics" or same
    ):  # all joints together have judged a corrected link
        return True
    return not _sure_in_part(one, answers) and answer.augmented.error < BLIND


def _sure_in_part(one: JointEffect, answers: Mapping[str, Diagnosis]) -> bool:
    """Whether an effect is sure although the explanation of its joint, which leaves little, is not sure as a whole."""
    answer = None if one.joint is None else answers.get(one.joint)
    if answer is None or one.link is not None or answer.verdict == "missing_physics":
        return False
    return answer.joint_probability < STATED <= one.probability and answer.augmented.error < BLIND


def _in_its_place(
    one: JointEffect, answers: Mapping[str, Diagnosis], of_links: Mapping[str, Sequence[str]]
) -> list[str]:
    """Effects that explain a joint as well as this one does, in words; for a quantity of a link the others that may be the wrong one, where it
    is sure that one of them is."""
    same = of_links.get(one.link, ()) if one.link else ()
    sure = one.probability * len(same) >= STATED
    values = [words_of(replace(one, element=name)) for name in same if sure and name != one.element]
    known = answers[one.joint].indistinguishable if one.joint is not None and one.joint in answers else ()
    groups = [group for group in known if one.element in group]
    return values + [in_words(name) for group in groups for name in group if name != one.element]


def _alike(joints: Sequence[str], answers: Mapping[str, Diagnosis]) -> dict[str, list[str]]:
    """Joints grouped by the summary of their answers; each joint has an answer of its own."""
    found: dict[str, list[str]] = {}
    for joint in joints:
        found.setdefault(answers[joint].summary, []).append(joint)
    return found


def _location(
    missing: Sequence[JointEffect], unknown: Sequence[str], undecided: Sequence[str]
) -> JointLocation:
    if missing:
        first = missing[0]
        if first.joint is None:
            return JointLocation(None, first.slot, "in the mounting of the base")
        where = WHERE.get(first.slot) or SENTENCES.get(first.slot, "in the inertia of the body")
        return JointLocation(first.joint, first.slot, f"at joint {first.joint}, {where}")
    if unknown:
        return JointLocation(unknown[0], "force", f"at joint {unknown[0]}, {SENTENCES['force']}")
    if undecided:
        return JointLocation(None, None, f"not decided; the model is in doubt at {', '.join(undecided)}")
    return JointLocation(None, None, "nowhere: the refitted model explains the effort of every joint")


def _next(
    answers: Mapping[str, Diagnosis], named: set[str], unknown: Sequence[str], undecided: Sequence[str]
) -> str:
    """The next experiment, for the joint that needs it most."""
    for joint in (*undecided, *unknown, *(j for j in answers if j in named)):
        if not answers[joint].settled:
            return f"joint {joint}: {answers[joint].next_experiment}"
    return next(iter(answers.values())).next_experiment


def assumptions_of(
    machine: Machine, found: Mapping[str, JointResult], answers: Mapping[str, Diagnosis]
) -> tuple[str, ...]:
    """What is assumed; of the scale of a recorded effort only where one was recorded."""
    late = [joint for joint, one in found.items() if one.by_reference]
    said = list(next(iter(answers.values())).assumptions)
    if len(late) == len(found):
        said = [line for line in said if line != FIXED_SCALE]
    if machine.body.contacts:
        said.append(IN_CONTACT)
    if late:
        said.append(COMPUTED.format(", ".join(late)))
    return tuple(said)
