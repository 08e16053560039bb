"""Diagnose a machine of several joints: at joint J, in slot S, element E.

Every joint is searched like the joint of a one-axis machine, with the forces of the rest of the body included. The false-alarm
rate accounts for the candidates of all joints. A link with a wrong mass or inertia, or with a payload, shows at every joint that
carries it. If one is found, it is corrected, and the joints that feel it are searched again.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import LOAD, MASS, PAYLOAD, TURNING, split
from rhythmid.body.machine import Machine
from rhythmid.diagnose.answer.compose_effort import compose_effort
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.case import EXPLAINED, SEARCHED, WEIGHED, Budget
from rhythmid.diagnose.constants import STATED
from rhythmid.diagnose.joints.base_tilt import BaseTilt, likely_tilt
from rhythmid.diagnose.joints.equivalents import equivalent_names, equivalents
from rhythmid.diagnose.joints.gear_compliance import GearCompliance, likely_gear
from rhythmid.diagnose.joints.joint_answer import MachineDiagnosis
from rhythmid.diagnose.joints.joint_case import JointResult, diagnose_joint, name_of
from rhythmid.diagnose.joints.joint_compose import compose_machine
from rhythmid.diagnose.joints.link_cause import LIGHTEST, feels, likely_link
from rhythmid.diagnose.joints.link_exchange import exchanged
from rhythmid.diagnose.joints.misfit import braking, late_efforts, misfits
from rhythmid.diagnose.joints.stated import augmented, stated_parameters
from rhythmid.diagnose.joints.wrong_link import MATTERS, WrongLink
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.joints.common_stamps import with_common_stamps
from rhythmid.identify.joints.held_reference import balances_of, likely_readings
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.joints.joint_plausibility import check_joints
from rhythmid.identify.joints.reference_delay import ReferenceDelay, reference_delay
from rhythmid.identify.joints.reference_lead import told_of
from rhythmid.model import INERTIA
from rhythmid.progress import Tell
from rhythmid.record.cleaning import cleaned_joints
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.same_recording import check_held_out
from rhythmid.record.unsigned import unsigned_joints
from rhythmid.result import Result, Row
from rhythmid.simulation.transport import INPUT_DELAY

if TYPE_CHECKING:
    from rich.console import Console

# masses, inertias and payloads of links that are corrected, at most, or the number of links if that is larger
MOST_LINKS = 2
# time of the correction of a link's value, in times that the balances of all joints take (measured: 20 for an arm of seven joints)
CORRECTION = 20.0


@dataclass(frozen=True)
class MachineAnswer(Result):
    """A diagnosis, the augmented machine, and the result at each joint, also `given` the body as the model has it."""

    diagnosis: MachineDiagnosis
    machine: Machine
    results: Mapping[str, JointResult]
    given: Mapping[str, JointResult]

    @property
    def headline(self) -> str:
        """The answer in one sentence."""
        return self.diagnosis.summary

    def show(self, console: "Console") -> None:
        from rhythmid.diagnose.joints.printed import show_diagnosis

        show_diagnosis(self.diagnosis, console)

    def to_dict(self) -> dict[str, Any]:
        """The diagnosis as plain data."""
        return self.diagnosis.to_dict()

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """The `joints` with their verdicts and errors, and the `missing` effects."""
        joints = [
            {"joint": joint, "verdict": one.verdict}
            | {name: one.fit[name].heldout_nrmse for name in ("refitted_nominal", "augmented")}
            for joint, one in self.diagnosis.joints.items()
        ]
        missing = [
            {"joint": one.place, "element": one.element, "probability": one.probability, "share": one.share}
            for one in self.diagnosis.missing
        ]
        return {"joints": joints, "missing": missing}


def diagnose_machine(
    records: Sequence[JointRecord],
    machine: Machine,
    holdout: Sequence[JointRecord] = (),
    catalogue: Catalogue | None = None,
    tell: Tell = lambda _: None,
    budget: float | None = None,
) -> MachineAnswer:
    """Find the physics that the model of a machine lacks to explain records; arguments as for `diagnose`.

    Raises InputError for records that cannot be judged: a joint or a floating base was not recorded, or too little motion.
    """
    if not records:
        raise InputError("no record is given; name at least one bag or table")
    check_held_out(records, holdout)
    known, spent = catalogue or load_catalogue(), Budget(budget)
    records, said = cleaned_joints(records, machine.turning)
    holdout, of_holdout = cleaned_joints(holdout, machine.turning)
    check_joints(machine, records)
    began = time.monotonic()
    balances = balances_of(machine, records)
    correction = CORRECTION * (time.monotonic() - began)
    unsigned = unsigned_joints(records)
    best: _Explained | None = None
    for reading in likely_readings(balances, records):
        tried = _explained(machine, reading, records, holdout, known, tell, spent, unsigned, correction)
        best = tried if best is None or tried.causes < best.causes else best
        if best.causes <= 1 or spent.spent:
            break
    assert best is not None  # there is at least one reading
    if not best.found:
        reasons = dict.fromkeys(best.refused.values())
        why = [
            f"{', '.join(j for j, one in best.refused.items() if one == each)}: {each}" for each in reasons
        ]
        raise InputError(f"no joint can be judged: {'; '.join(why)}")
    stated, known = best.stated, {**best.found, **best.given}
    answers = {joint: _answer(one, known[joint], stated[joint]) for joint, one in best.found.items()}
    told = () if records[0].sampled else tuple(told_of(best.leads))
    put_right = (one.beside(machine) for one in best.links.values())
    late = () if best.delay is None else (best.delay.told,)
    notes = (
        *machine.body.notes,
        *said,
        *of_holdout,
        *told,
        *late,
        *put_right,
        *(one.words for one in best.gears.values()),
        *misfits(answers, braking(best.found, machine)),
        *late_efforts(best.found),
    )
    diagnosis = compose_machine(
        machine,
        best.found,
        answers,
        best.stated,
        best.links,
        best.refused,
        notes,
        best.delay,
        best.tilt,
        best.gears,
    )
    return MachineAnswer(
        diagnosis, augmented(best.machine, best.found, stated, best.links), best.found, best.given
    )


@dataclass(frozen=True, eq=False)
class _Explained:
    """The results of all joints.

    `machine` has the corrected parameters of links and the `tilt` of the base; the `gears` that yield, the `leads` [s] and the `delay` of
    references were taken into account. `given` are the results with the body as it is given.
    """

    machine: Machine
    found: Mapping[str, JointResult]
    refused: Mapping[str, str]
    links: Mapping[str, WrongLink]
    leads: Mapping[str, float]
    delay: ReferenceDelay | None
    tilt: BaseTilt | None
    gears: Mapping[str, GearCompliance]
    given: Mapping[str, JointResult]

    @property
    def stated(self) -> dict[str, tuple[str, ...]]:
        """Labels that the answer states, by joint."""
        return {joint: stated_at(one) for joint, one in self.found.items()}

    @property
    def causes(self) -> int:
        """Number of causes that explain the records: stated ones, and inconsistent joints at which none is stated."""
        stated = self.stated
        open_ = [
            joint
            for joint, one in self.found.items()
            if one.result.decision.verdict != "consistent" and not stated[joint] and _different(one)
        ]
        shared = len(self.links) + len(self.gears) + (self.tilt is not None)
        return shared + sum(map(len, stated.values())) + len(open_)


def _explained(
    machine: Machine, balances: JointBalances, records: Sequence[JointRecord], holdout: Sequence[JointRecord],
    catalogue: Catalogue, tell: Tell, budget: Budget, unsigned: Mapping[str, str], correction: float,
) -> _Explained:  # fmt: skip
    """Search every joint whose effort has its sign, correct a link's mass or inertia where one is found, and search the joints that feel it again.

    A correction takes about so many seconds.
    """
    found: dict[str, JointResult] = {}
    refused = dict(unsigned)
    links: dict[str, WrongLink] = {}
    balances = with_common_stamps(balances)

    def search(joints: Sequence[str], end: float = EXPLAINED) -> ReferenceDelay | None:
        """Search joints of the machine and the balances as they are now; the delay of their references.

        The joints share the time until this share of the budget has passed: each has the same part of what those before it have left, in which it is
        also weighed.
        """
        unseen = JointBalances.of(machine, holdout, balances) if holdout else None
        delay = reference_delay(balances, balances.computed) if balances.computed else None
        late = 0.0 if delay is None else delay.shared.value
        for place, joint in enumerate(joints):
            tell(f"joint {joint}")
            own = budget.part(end, len(joints) - place)
            try:
                found[joint] = diagnose_joint(balances, unseen, joint, catalogue, tell, own, late)
            except InputError as error:
                refused[joint] = str(error)
        return delay

    delay = search([joint for joint in machine.joints if joint not in unsigned], SEARCHED)
    given = dict(found)
    most = max(MOST_LINKS, len(machine.body.links))
    tilt: BaseTilt | None = None
    gears: dict[str, GearCompliance] = {}
    uncorrected = machine
    # the machine whose shared causes have been compared with the laws of its joints
    weighed: Machine | None = None
    while max(len(links), len(balances.refuted_links)) < most and budget.allows(correction, WEIGHED):
        told = _values_of_links(found, set(links))
        again = list(found)
        shared = None
        if weighed is not machine:
            weighed = machine
            shared = _shared_cause(balances, records, found, tilt, links, told)
        if budget.passed(WEIGHED):
            break
        if isinstance(shared, GearCompliance):
            gears[shared.joint], weighed = shared, None
            balances = balances.with_gears({**balances.gears, shared.joint: shared.gear})
        elif isinstance(shared, BaseTilt):
            tilt, machine = shared, machine.with_gravity(shared.gravity)
            uncorrected = uncorrected.with_gravity(shared.gravity)
            balances = JointBalances.of(machine, records, balances)
        elif shared is not None:
            links[shared.parameter], machine = shared, shared.corrected
            balances = JointBalances.of(machine, records, balances)
            again = [joint for joint in found if feels(balances, joint, split(shared.parameter)[0])]
        elif told:
            parameter, again = next(iter(told.items()))
            tell(f"{parameter} of {again[0]} is refuted by the joints that it moves")
            again, link = again[:1], split(parameter)[0]
            for name in balances.links(again[0]):  # all kinds of changes of the link have been tried
                balances = balances.without(again[0], name) if split(name)[0] == link else balances
            balances = JointBalances.of(machine, records, balances)
        else:
            break
        if shared is not None:
            tell(shared.words)
        delay = search(again)
    if len(links) > 1 and budget.allows(correction, WEIGHED):
        tell("fitting the changes of all links together")
        if together := exchanged(JointBalances.of(uncorrected, records, balances), records, found, links):
            changed = {split(parameter)[0] for parameter in links}
            links, machine = together, next(iter(together.values())).corrected
            balances = JointBalances.of(machine, records, balances)
            delay = search([j for j in found if any(feels(balances, j, link) for link in changed)])
    return _Explained(machine, found, refused, links, balances.leads, delay, tilt, gears, given)


def _shared_cause(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult], tilt: BaseTilt | None,
    links: Mapping[str, WrongLink], told: Mapping[str, Sequence[str]],
) -> BaseTilt | GearCompliance | WrongLink | None:  # fmt: skip
    """The cause of the machine as a whole with the strongest evidence; one `tilt` is enough. `links` are corrected, and `told` are values of links that
    joints state by themselves."""
    likely = (
        likely_tilt(balances, records, found) if tilt is None else None,
        likely_gear(balances, found),
        likely_link(balances, records, found, links, {split(parameter)[0] for parameter in told}),
    )
    return max((one for one in likely if one is not None), key=lambda one: one.weight, default=None)


def _values_of_links(found: Mapping[str, JointResult], known: set[str]) -> dict[str, list[str]]:
    """The values of links that joints state, without those that are `known`, with these joints; those with the strongest evidence first."""
    made: list[tuple[float, str, str]] = []
    for joint, one in found.items():
        contest = one.result.contest
        gain = one.result.selection.chosen.prediction.score - contest.nominal.prediction.score
        for label in stated_at(one):
            link = label.removeprefix(f"{BODY}.")
            whole = f"{split(link)[0]}.{LOAD}"  # all its parameters were fitted
            if label.startswith(f"{BODY}.") and link not in known and whole not in known:
                made.append((-gain, link, joint))
    told: dict[str, list[str]] = {}
    for _, link, joint in sorted(made):
        told.setdefault(link, []).append(joint)
    return told


def stated_at(one: JointResult) -> tuple[str, ...]:
    """Labels that the answer at a joint states: elements, a wrong value of the body, or a delay."""
    decision, chosen = one.result.decision, one.result.selection.chosen
    own = _own_labels(one)
    if decision.verdict == "missing_physics":
        return tuple(label for label in decision.named if _differs(one, label))
    if not _different(one):
        return ()
    alike = _held_by_alike(one) >= STATED
    if alike and chosen.kind == "effects" and decision.verdict == "undecided":
        return chosen.elements
    if chosen.kind not in ("freed_value", "delay"):
        return ()
    known = all(label == INERTIA or name_of(one.joint, label)[0] != label for label in own)
    if not known:  # a wrong value of the path itself is left to the model's author
        return ()
    if not (alike or decision.joint >= STATED):
        return decision.agreed  # the effects that the evidence has beside any value
    named = tuple(label for label in decision.named if _differs(one, label))
    return named if alike else tuple(label for label in named if decision.probability[label] >= STATED)


def _own_labels(one: JointResult) -> list[str]:
    """The chosen labels at a joint that are not elements: values of the body or of the path, or a delay."""
    chosen = one.result.selection.chosen
    return [label for label in chosen.elements if one.result.chosen.fit.model.term(label) is None]


def _different(one: JointResult) -> bool:
    """Whether anything other than unchanged values was chosen at a joint, or nothing was chosen at all."""
    own, chosen = _own_labels(one), one.result.selection.chosen
    return len(own) < max(len(chosen.elements), 1) or any(_differs(one, label) for label in own)


def _held_by_alike(one: JointResult) -> float:
    """Share of the evidence held by the chosen effect and by single effects that predict as well.

    Where it is large, the joint is certain although the name is not; the answer lists the others as indistinguishable.
    """
    decision, chosen = one.result.decision, one.result.selection.chosen
    if len(chosen.elements) != 1:
        return 0.0
    names = {chosen.names[0], *(name for group in equivalents(one) for name in group)}
    rivals = [h for h in one.result.contest.hypotheses if len(h.elements) == 1 and h.names[0] in names]
    return sum(decision.weights.get(rival.key, 0.0) for rival in rivals)


def _differs(one: JointResult, label: str) -> bool:
    """Whether a value of the body differs from the given one; a payload is compared with the mass of its link."""
    if label == INPUT_DELAY or label not in one.case.nominal.parameters:
        return True
    before, after = one.case.nominal.value(label), one.result.chosen.model.value(label)
    owner, kind = split(label)
    if _removed(kind, before, after):
        return False  # an effect that removes a link's mass or its whole inertia is another one
    known = one.case.nominal.parameters
    whole = known[f"{owner}.{MASS}"].value if kind == PAYLOAD and f"{owner}.{MASS}" in known else before
    return abs(after - before) > MATTERS * abs(whole)


def _removed(kind: str, before: float, after: float) -> bool:
    """Whether a value of a link has gone from what it is in the model. An inertia in a file may be that about the joint, of which
    the inertia about the centre of mass may be any share."""
    return after <= 0.0 if kind == TURNING else after < LIGHTEST * before


def _answer(one: JointResult, given: JointResult, stated: Sequence[str]) -> Diagnosis:
    """The answer at a joint; its nominal error is that with the body as it is `given`, before any of its values was corrected."""
    sizes = stated_parameters(one.result, stated)
    made = replace(compose_effort(one.case, one.result, ()), parameters=sizes)
    if given is not one:
        nominal = compose_effort(given.case, given.result, ()).fit["refitted_nominal"]
        made = replace(made, fit={**made.fit, "refitted_nominal": nominal})
    return replace(made, indistinguishable=equivalent_names(one))
