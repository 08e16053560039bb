"""Identify a machine with several joints: each joint's path, the links' inertias, and what is not identifiable.

A joint's path is fitted by inverse dynamics together with the force that the body requires at the joint. This needs
a recorded effort, or one that follows from the reference and the controller's known gains. The links' inertial
parameters follow from the efforts of all joints. Where a reference is known, the machine is also simulated in free
run over the stretches of the records. The paths' parameters are then refined to fit the measured motion, with the
result of inverse dynamics as prior.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from rhythmid.body.body import BODY
from rhythmid.body.machine import Machine
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.estimate import EffortFit, size_of
from rhythmid.identify.joints.adopted_inertia import adopted_inertia
from rhythmid.identify.joints.base_parameters import InertialEstimate, estimate_inertia
from rhythmid.identify.joints.correlation import Correlations
from rhythmid.identify.joints.effort_power import braking_note
from rhythmid.identify.joints.held_reference import balances_of, not_told
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.identify.joints.joint_plausibility import check_joints
from rhythmid.identify.joints.output_error import Knowledge, free_runs, refine
from rhythmid.identify.joints.reference_delay import ReferenceDelay, fit_with_delay, reference_delay
from rhythmid.identify.search_quality import POOR_MOTION
from rhythmid.model import INERTIA, Model
from rhythmid.progress import Tell
from rhythmid.record.cleaning import cleaned_joints
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.same_recording import check_held_out
from rhythmid.record.unsigned import unsigned_joints
from rhythmid.report.quantity import in_words
from rhythmid.result import Result, Row
from rhythmid.statistics import NORMAL_95

if TYPE_CHECKING:
    from rich.console import Console

WORSE = 1.1  # ratio of free-run errors, identified over given values, above which a warning is given
# share of the motion by which the error also has to grow: free runs of a correct model scatter by more
MUCH = 0.005
# standard deviations by inverse dynamics that a parameter may move in free runs: it also contains errors of the filter
LOOSE = 5.0
RELATIVE = 0.3  # share of its value by which a parameter may move at least
# free-run error of a correct model as a share of the motion (measured: machines in the air 1 to 3 %)
EXPECTED = 0.02
AT_BOUND = 1e-6  # standard deviations from a bound that rounding makes


@dataclass(frozen=True)
class JointEstimate:
    """A value with its standard deviation and unit, and the bounds within which it was fitted."""

    value: float
    std: float
    unit: str
    bounds: tuple[float, float] = (-math.inf, math.inf)

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval; it ends at a bound."""
        low, high = self.value - NORMAL_95 * self.std, self.value + NORMAL_95 * self.std
        return max(low, self.bounds[0]), min(high, self.bounds[1])

    @property
    def at_bound(self) -> bool:
        """Whether the value is at a bound: the records ask for one beyond it."""
        return any(abs(self.value - one) <= AT_BOUND * self.std for one in self.bounds)

    def to_dict(self) -> dict[str, Any]:
        """The estimate as plain data."""
        return {
            "value": self.value,
            "std": self.std,
            "unit": self.unit,
            "interval": list(self.interval),
            "at_bound": self.at_bound,
        }


@dataclass(frozen=True)
class MachineIdentification(Result):
    """Result of the identification of a machine with several joints.

    `parameters` are named "joint.element.parameter" and "body.joint.armature". `effort_nrmse` is the error of each
    joint's predicted effort. `free_run` is the error of its motion with the given and the identified values; where
    `unseen`, on records or ends of records that are held out. `worse` are the joints whose motion the identified
    values predict worse than the given ones. `not_identified` are the joints of which they predict neither motion
    nor effort. `not_separable` lists parameters that are not identifiable separately, in words. `fits` holds for
    each joint its effort balance, its given path, and the fit.
    """

    machine: Machine
    parameters: dict[str, JointEstimate]
    correlations: Correlations
    not_separable: tuple[str, ...]
    inertia: InertialEstimate | None
    effort_nrmse: dict[str, float]
    free_run: dict[str, dict[str, float]]
    unseen: bool
    worse: tuple[str, ...] = ()
    not_identified: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
    fits: Mapping[str, tuple[Balance, Model, EffortFit]] = field(default_factory=dict, repr=False)
    reference_delay: ReferenceDelay | None = None

    @property
    def usable(self) -> bool:
        """Whether the fit explains enough of every joint to count as an identification."""
        return not self.not_identified

    @property
    def missed(self) -> str:
        """What is said of joints that are not identified."""
        of = "the effort and of the motion" if self.free_run else "the effort"
        return f"more than {100.0 * POOR_MOTION:.0f} % of {of} is missed"

    @property
    def headline(self) -> str:
        """How well the efforts are predicted."""
        if not self.usable:
            return f"Not identified: {', '.join(self.not_identified)}: {self.missed}"
        worst = max(self.effort_nrmse, key=lambda joint: self.effort_nrmse[joint])
        return f"{len(self.parameters)} parameters; efforts missed by {100.0 * self.effort_nrmse[worst]:.3g} % at most, at {worst}"

    def show(self, console: "Console") -> None:
        from rhythmid.identify.joints.printed import show_identification

        show_identification(self, console)

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """The `parameters`, and the `errors` of each joint."""
        rows = [
            {"name": name, "value": one.value, "std": one.std, "unit": one.unit}
            for name, one in self.parameters.items()
        ]
        errors = [
            {"joint": joint, "effort": error} | {name: run[joint] for name, run in self.free_run.items()}
            for joint, error in self.effort_nrmse.items()
        ]
        return {"parameters": rows, "errors": errors}

    def to_dict(self) -> dict[str, Any]:
        """The identification as plain data."""
        from dataclasses import asdict

        return {
            "usable": self.usable,
            "parameters": {name: one.to_dict() for name, one in self.parameters.items()},
            "correlations": self.correlations.to_dict(),
            "not_separable": list(self.not_separable),
            "inertia": None if self.inertia is None else asdict(self.inertia),
            "quality": {
                "effort_nrmse": self.effort_nrmse,
                "free_run": self.free_run,
                "unseen": self.unseen,
                "worse": list(self.worse),
                "not_identified": list(self.not_identified),
            },
            "notes": list(self.notes),
            "reference_delay": None if self.reference_delay is None else asdict(self.reference_delay),
        }


@threadpool_limits.wrap(limits=1)
def identify_machine(
    records: Sequence[JointRecord],
    machine: Machine,
    holdout: Sequence[JointRecord] = (),
    tell: Tell = lambda _: None,
    free: bool = True,
) -> MachineIdentification:
    """Identify the free parameters of a machine, the armature of every joint, and its links' inertias.

    Where references are known, `free` adds a refinement of the paths by free runs. Without `holdout` the last fifth
    of each record is held out from it. Raises InputError for records that are too short, lack a joint, or have
    joints in another order.
    """
    if not records:
        raise InputError("no record is given; name at least one bag or table")
    check_held_out(records, holdout)
    records, said = cleaned_joints(records, machine.turning)
    holdout, of_holdout = cleaned_joints(holdout, machine.turning)
    seen, unseen = (records, holdout) if holdout else _split(records)
    check_joints(machine, seen)
    balances = balances_of(machine, seen)
    fits: dict[str, tuple[Balance, EffortFit]] = {}
    found: dict[str, JointEstimate] = {}
    correlations: list[Correlations] = []
    errors: dict[str, float] = {}
    rotors = {
        joint: rotor_freed(model, machine.body.parameters[f"{joint}.armature"])
        for joint, model in balances.models.items()
    }
    balances = replace(balances, models=rotors)
    common = reference_delay(balances, balances.computed) if balances.computed else None
    lates = {
        joint: common.shared.value
        for joint in machine.joints
        if common is not None and joint in balances.computed
    }
    for joint in machine.joints:
        tell(f"joint {joint}")
        balance = balances.balance(joint, lates.get(joint, 0.0))
        fit = fit_with_delay(balance, balances.models[joint], joint, common)
        fits[joint] = balance, fit
    inertia = better = None
    if not balances.computed:
        tell("inertias of the links")
        inertia = estimate_inertia(balances, fits)
        better = adopted_inertia(balances, fits, inertia, seen, unseen, rotor_freed)
    given, models = machine, balances.models
    if better is not None:
        given, models, fits = better.machine, dict(better.models), dict(better.fits)
    identified = given
    for joint, (balance, fit) in fits.items():
        errors[joint] = fit.error / size_of(balance)
        identified = _with_fit(identified, given, joint, fit, lates.get(joint), found)
        correlations.append(Correlations.of_fit(joint, fit))
    tell("free runs")
    runs, notes = {}, [*machine.body.notes, *said, *of_holdout]
    notes.extend(f"{joint}: {why}" for joint, why in unsigned_joints(records).items())
    notes.extend(_braking(balances, fits, errors))
    if common is not None:
        notes.append(common.told)
    if better is not None:
        notes.append(better.note)
    others = JointBalances.of(machine, unseen, balances)
    try:
        made = free_runs(machine, others, unseen)
        runs["given"] = made.nrmse
        notes.extend(made.told("given"))
        if free and balances.computed:
            known = _known(identified, found)
            identified, spread, refined = refine(identified, balances, seen, known, EXPECTED)
            correlations.append(refined)
            for name, std in spread.items():
                found[name] = replace(found[name], value=identified.value(name), std=std)
        made = free_runs(identified, others, unseen)
        runs["identified"] = made.nrmse
        notes.extend(made.told("identified"))
    except InputError as error:
        notes.append(f"no free run: {error}")
    if ends := [name for name, one in found.items() if one.at_bound]:
        notes.append(
            f"{', '.join(ends)}: the fit ends at the bound of the value, and so does its interval; the records ask for a value beyond it"
        )
    told = Correlations.joined(correlations)
    worse = worse_joints(runs)
    notes.extend(_warning(joint, runs) for joint in worse)
    return MachineIdentification(
        identified, found, told, (*_not_separable(told, balances.computed), *not_told(balances, seen)), inertia, errors,
        runs, True, worse, poor_joints(errors, runs.get("identified")), tuple(notes),
        {joint: (balance, models[joint], fit) for joint, (balance, fit) in fits.items()}, common,
    )  # fmt: skip


def _braking(
    balances: JointBalances, fits: Mapping[str, tuple[Balance, EffortFit]], errors: Mapping[str, float]
) -> Iterator[str]:
    """What to check at joints with a poor fit whose recorded efforts fall with their speeds."""
    for joint, (balance, _) in fits.items():
        turns = balances.machine.body.joints[joint].rotational
        note = braking_note(joint, balance, balances.models[joint], turns)
        if note is not None and errors[joint] > POOR_MOTION:
            yield note


def worse_joints(runs: Mapping[str, Mapping[str, float]]) -> tuple[str, ...]:
    """The joints whose motion free runs predict worse with the identified values than with the given ones."""
    if not {"given", "identified"} <= runs.keys():
        return ()
    before, after = runs["given"], runs["identified"]
    return tuple(joint for joint in before if after[joint] > max(WORSE * before[joint], before[joint] + MUCH))


def poor_joints(efforts: Mapping[str, float], motions: Mapping[str, float] | None) -> tuple[str, ...]:
    """The joints with more than `POOR_MOTION` unexplained: of the effort, and of the free-run motion where there is one.

    One of the two is enough for an identification. Without a controller even the correct machine drifts from the
    recorded motion, because small errors of its effort add up. Where a reference drives the joint, its effort may
    be known only up to a guessed scale.
    """
    return tuple(
        joint
        for joint, effort in efforts.items()
        if effort > POOR_MOTION and (motions is None or motions[joint] > POOR_MOTION)
    )


def _warning(joint: str, runs: Mapping[str, Mapping[str, float]]) -> str:
    before, after = (100.0 * runs[name][joint] for name in ("given", "identified"))
    return (
        f"{joint}: the identified values predict the motion worse ({after:.3g} % of it is missed) than the given ones ({before:.3g} %); do not "
        "use them: the effort may have another scale or other instants than stated, or the model lacks an effect; try `rhythmid diagnose`"
    )


def _split(records: Sequence[JointRecord]) -> tuple[list[JointRecord], list[JointRecord]]:
    """The first four fifths of every record, and the rest."""
    cuts = [(record, record.span[0] + 0.8 * (record.span[1] - record.span[0])) for record in records]
    return (
        [record.cut(record.span[0], at) for record, at in cuts],
        [record.cut(at, record.span[1]) for record, at in cuts],
    )


def rotor_freed(model: Model, armature: float) -> Model:
    """The path with the rotor's inertia free but not negative: the body's value for it is a guess."""
    least = max(model.mass.value - armature, 0.0)
    return replace(model, mass=replace(model.mass, fixed=False, bounds=(least, math.inf)))


def _with_fit(
    machine: Machine, given: Machine, joint: str, fit: EffortFit, late: float | None,
    found: dict[str, JointEstimate],
) -> Machine:  # fmt: skip
    """The machine with one joint's fit; the fit's estimates are added to `found`."""
    parameters = fit.model.parameters
    for place, name in enumerate(fit.names, start=1):
        std, value = float(fit.std[place]), parameters[name]
        if name == INERTIA:
            armature = f"{joint}.armature"
            rotor = given.body.parameters[armature] + value.value - given.paths[joint].mass.value
            machine = machine.with_inertial({armature: max(rotor, 0.0)})
            found[f"{BODY}.{armature}"] = JointEstimate(max(rotor, 0.0), std, value.unit, (0.0, math.inf))
        elif name.startswith(f"{BODY}."):
            machine = machine.with_inertial({name.removeprefix(f"{BODY}."): value.value})
            found[name] = JointEstimate(value.value, std, value.unit, value.bounds)
        else:
            machine = machine.with_values({f"{joint}.{name}": value.value})
            found[f"{joint}.{name}"] = JointEstimate(value.value, std, value.unit, value.bounds)
    delay = f"{joint}.input_delay.delay"
    if late is not None and delay in machine.parameters and not machine.parameters[delay].fixed:
        whole = max(machine.value(delay) + late + fit.alignment, 0.0)
        machine = machine.with_values({delay: whole})
        found[delay] = JointEstimate(whole, float(fit.std[0]), "s")
    return machine


def _known(machine: Machine, found: dict[str, JointEstimate]) -> dict[str, Knowledge]:
    """Priors from inverse dynamics for the parameters that free runs refine: all but the rotors' inertias, which it
    determines better."""
    known = {}
    for name, one in found.items():
        if name.startswith(f"{BODY}."):
            continue
        low, high = machine.parameters[name].bounds
        spread = max(LOOSE * one.std, RELATIVE * abs(one.value), 1e-6)
        known[name] = Knowledge(one.value, spread, low, high)
    return known


def _not_separable(correlations: Correlations, computed: Sequence[str]) -> tuple[str, ...]:
    """Parameters that are not identifiable separately, in words."""
    said = []
    for first, second, value in correlations.close():
        pair = in_words(f"{first} and {second}")
        said.append(f"{pair}: only a combination of the two is identifiable (correlation {value:.2f})")
    if computed:
        said.append(
            "armature and delay of the reference: without a recorded torque a later command looks like a heavier rotor"
        )
        said.append(
            "a constant torque and the controller's proportional gain: both move the rest position, so the gain is taken as given"
        )
        said.append("damping and the controller's derivative gain: the gain is taken as given")
    return tuple(said)
