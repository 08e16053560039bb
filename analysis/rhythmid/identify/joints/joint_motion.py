"""The motion of several joints as inverse dynamics needs it: for each joint its own, and what the rest of the body asks of it.

Along joint j the body asks for m_j a_j + c_j, with m_j the inertia that the joint's path has and the coupling c_j the rest of the
inverse dynamics of the whole body (M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362 for its linearity in the inertial
parameters). So each joint is balanced as the one of a machine of one axis, with the same elements.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.body.body import BODY
from rhythmid.body.inertial_parameter import MASS, PAYLOAD, TURNING, described, split
from rhythmid.body.machine import Machine
from rhythmid.elements.element import Element
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.bandwidth import (
    Bandwidth,
    bandwidth_below,
    bandwidth_of_motion,
)
from rhythmid.identify.inverse_dynamics.motion import FINER, Motion, Stretch, low_pass
from rhythmid.identify.inverse_dynamics.reference_path import Reference
from rhythmid.identify.joints.joint_stretch import JointStretch, joint_stretches
from rhythmid.model import Model, Term
from rhythmid.record.joint_record import JointRecord, Taken
from rhythmid.value import Value

Array = NDArray[np.float64]
# periods of the cut-off at both ends of a stretch, in which a filter that begins there errs by several times the noise (measured on
# flights between contacts)
CLEAR = 1.5
SHORT = 400  # samples of a stretch, up to which its filter is a matrix
FAINT = 1e-3  # of a joint's effort, below which what a link does to it is not looked at


class JointBalance(Balance):
    """A balance of many short stretches: the filter of each length is a matrix that is made once."""

    def filtered(self, signal: Array, period: float) -> Array:
        if len(signal) > SHORT:
            return super().filtered(signal, period)
        return _filter(len(signal), period, self.bandwidth.effort) @ signal


@lru_cache(maxsize=512)
def _filter(length: int, period: float, frequency: float) -> Array:
    """The zero-phase low-pass as a matrix (length, length)."""
    return np.ascontiguousarray(low_pass(np.eye(length), period, frequency))


def nothing(t):
    """The force of the term that stands for the body's parameters: none, it is in the coupling."""
    return 0.0


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motions of one stretch: pose, rate and acceleration (n, nv) of the whole body below `cut` [Hz], and the forces (n, nv) that
    it asks for."""

    stretch: JointStretch
    time: Array
    pose: Array
    rate: Array
    acceleration: Array
    force: Array
    period: float
    every: int


@dataclass(frozen=True, eq=False)
class JointBalances:
    """The balances of effort of all joints: of each its path as a model of one axis, and its motions.

    `computed` are the joints whose effort is what their controller's known gains make of the reference; `leads` [s] of others are what the
    references in their recorded efforts were ahead by, and are not in the motions. `rotor_like` are by joint the parameters of links that
    do there what the rotor's inertia does, with how much of that [kg m²] a unit of each is. `refuted` are the pairs of a joint and a link's
    parameter that is not freed there, because the other joints refute the value that it takes.
    """

    machine: Machine
    models: dict[str, Model]
    motions: dict[str, list[Motion]]
    bandwidths: dict[str, Bandwidth]
    bodies: list[BodyMotion]
    period: float
    computed: tuple[str, ...]
    leads: Mapping[str, float] = field(default_factory=dict)
    rotor_like: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    refuted: frozenset[tuple[str, str]] = frozenset()

    @classmethod
    def of(
        cls,
        machine: Machine,
        records: Sequence[JointRecord],
        alike: "JointBalances | None" = None,
    ) -> "JointBalances":
        """The balances of these records, filtered as those `alike` and without the same leads. Raises InputError where the records hold
        too little.

        What a joint feels is that of those `alike`, too, unless payloads or centres of mass are at other places.
        """
        stretches = joint_stretches(machine, records)
        cut, dominant = (alike.cut, alike.dominant) if alike else _cut(machine, stretches)
        bodies = [_body_motion(machine, one, cut) for one in stretches]
        names = [f"{link}.{MASS}" for link in machine.body.links]
        names += [f"{link}.{PAYLOAD}" for link in machine.body.ends]
        names += [f"{link}.{TURNING}" for link in machine.body.hinges]
        columns = [machine.body.columns(names, one.pose, one.rate, one.acceleration) for one in bodies]
        models: dict[str, Model] = {}
        motions: dict[str, list[Motion]] = {}
        known = alike if alike and _same_places(machine, alike.machine) else None
        rotor_like = dict(known.rotor_like) if known else {}
        refuted = alike.refuted if alike else frozenset()
        for joint in machine.joints:
            seen = known.links(joint) if known else _links(machine, joint, names, columns, bodies)
            if not known:
                rotor_like[joint] = _rotors(machine, joint, seen, names, columns, bodies)
            rotors = rotor_like[joint]
            computed = joint in stretches[0].reference  # what a controller asks for goes into its actuator
            taken = "before_actuator" if computed else records[0].taken
            held = {name for at, name in refuted if at == joint}
            models[joint] = joint_model(machine, joint, taken, seen, rotors, held)
            made = []
            for body, column in zip(bodies, columns, strict=True):
                own = {link: column[:, :, names.index(link)] for link in seen}
                made.append(_motion(machine, models[joint], joint, body, own))
            motions[joint] = made
        period = max(one.period for one in stretches)
        bandwidths = (
            alike.bandwidths
            if alike
            else {joint: _bandwidth(motions[joint], cut, dominant) for joint in machine.joints}
        )
        computed = tuple(joint for joint in machine.joints if joint in stretches[0].reference)
        made = cls(
            machine,
            models,
            motions,
            bandwidths,
            bodies,
            period,
            computed,
            rotor_like=rotor_like,
            refuted=refuted,
        )
        return made.with_leads(alike.leads) if alike else made

    def with_leads(self, leads: Mapping[str, float]) -> "JointBalances":
        """The balances with recorded efforts in which the references are older by these leads [s]."""
        motions = dict(self.motions)
        for joint, lead in leads.items():
            gain = self.machine.paths[joint].value("position_control.proportional")
            motions[joint] = [
                replace(
                    motion, effort=motion.effort + gain * _decimated(body, one.moved(body.stretch.time, lead))
                )
                if (one := body.stretch.held.get(joint)) is not None
                else motion
                for motion, body in zip(self.motions[joint], self.bodies, strict=True)
            ]
        return replace(self, motions=motions, leads={**self.leads, **leads})

    def without(self, joint: str, parameter: str) -> "JointBalances":
        """The balances in which the search at a joint does not free a parameter of a link."""
        return replace(self, refuted=self.refuted | {(joint, parameter)})

    def links(self, joint: str) -> tuple[str, ...]:
        """The links whose masses and inertias a joint feels, as "link.mass" and "link.inertia", and those whose payloads it would feel, as
        "link.payload"."""
        return tuple(name.removeprefix(f"{BODY}.") for name in self.motions[joint][0].links)

    def rotors(self, joint: str) -> tuple[str, ...]:
        """Those parameters of links that a joint feels as it does its rotor's inertia, which are bounded above."""
        return tuple(self.rotor_like[joint])

    @property
    def cut(self) -> float:
        """Highest frequency [Hz] of the motion."""
        return next(iter(self.bandwidths.values())).motion

    @property
    def dominant(self) -> float:
        """Strongest frequency [Hz] of the motion."""
        return next(iter(self.bandwidths.values())).dominant

    def balance(self, joint: str, late: float = 0.0) -> Balance:
        """The balance of one joint; a reference acts there `late` [s] after its stamp. Raises InputError where too few samples are
        left."""
        motions = self.motions[joint]
        if late != 0.0:
            motions = [_later(motion, self.models[joint], late) for motion in motions]
        return JointBalance.of_motions(motions, self.bandwidths[joint], self.period, CLEAR)


def _later(motion: Motion, model: Model, late: float) -> Motion:
    """A motion whose reference acts `late` [s] later; one without a reference as it is."""
    if motion.reference is None:
        return motion
    reference = replace(motion.reference, age=motion.reference.age + late)
    return replace(motion, reference=reference, effort=reference.force(model, motion))


def joint_model(
    machine: Machine,
    joint: str,
    taken: Taken,
    links: Sequence[str],
    rotors: Mapping[str, float],
    held: Collection[str] = (),
) -> Model:
    """The path of a joint as a model of one axis, with masses, inertias and payloads of links as parameters of a term `body`; without its
    actuator where the effort was recorded behind that. A mass or an inertia that does what the rotor's does, one of `rotors`, may be less than given by
    more than the whole rotor: any other change is the rotor's, of which files of robots know little. Those `held` are no candidates."""
    path = machine.paths[joint]
    terms = [t for t in path.terms if taken != "after_actuator" or t.element.slot != "actuator"]
    known, values = machine.body.parameters, {}
    for link in links:
        said = machine.inertial.get(link)
        most = max(known[link] - known[f"{joint}.armature"] / rotors[link], 0.0) if link in rotors else np.inf
        values[link] = said or Value(known[link], described(link).unit, True, (0.0, most))
    parameters = tuple(replace(described(link), name=link, fixed=link in held) for link in links)
    element = Element(
        name=BODY, slot="force", title="Body", equation="coupling", parameters=parameters, reference="", kernel=nothing,
        acts="drive", candidate=False,
    )  # fmt: skip
    armature = machine.inertial.get(f"{joint}.armature")
    # no rotor has a negative inertia
    least = max(path.mass.value - known[f"{joint}.armature"], 0.0)
    free = armature is not None and not armature.fixed
    mass = replace(path.mass, fixed=not free, bounds=(least, np.inf))
    return replace(path, mass=mass, terms=(*terms, Term(element, BODY, values)))


def _cut(machine: Machine, stretches: Sequence[JointStretch]) -> tuple[float, float]:
    """The highest frequency of the fastest joint's motion, and the strongest of all."""
    found = []
    for joint in machine.joints:
        place = machine.body.joints[joint].position
        raw = [
            Stretch(
                one.record, one.name, one.time, one.pose[:, place], one.time, one.period, "force", "position"
            )
            for one in stretches
        ]
        found.append(bandwidth_of_motion(raw))
    return max(cut for cut, _ in found), float(np.median([line for _, line in found]))


def _body_motion(machine: Machine, stretch: JointStretch, cut: float) -> BodyMotion:
    every = max(1, int(1.0 / (FINER * cut * stretch.period)))
    time = stretch.time[::every]
    pose = low_pass(stretch.pose, stretch.period, cut)[::every]
    rate = CubicSpline(time, pose).derivative()(time)
    acceleration = CubicSpline(time, rate).derivative()(time)
    force = machine.body.inverse(pose, rate, acceleration)
    return BodyMotion(stretch, time, pose, rate, acceleration, force, stretch.period * every, every)


def _same_places(one: Machine, other: Machine) -> bool:
    """Whether the payloads and the centres of mass of two machines are at the same places of their links."""
    places = (
        (one.body.ends, other.body.ends),
        (one.body.centres, other.body.centres),
    )
    return all(
        first.keys() == second.keys() and all(np.array_equal(first[link], second[link]) for link in first)
        for first, second in places
    )


def _links(
    machine: Machine, joint: str, names: Sequence[str], columns: Sequence[Array], bodies: Sequence[BodyMotion]
) -> tuple[str, ...]:
    """The masses and inertias of links that a joint feels, and the payloads that it would feel if they were as heavy as their links."""
    whole, made = _felt(machine, joint, names, columns, bodies)
    felt = np.sqrt(np.mean(made**2, axis=0)) > FAINT * whole
    return tuple(name for name, one in zip(names, felt, strict=True) if one)


def _rotors(
    machine: Machine, joint: str, links: Sequence[str], names: Sequence[str], columns: Sequence[Array],
    bodies: Sequence[BodyMotion],
) -> dict[str, float]:  # fmt: skip
    """Those among these parameters that a joint feels as it does its rotor's inertia, and how much of that a unit of each is."""
    own = machine.body.joints[joint].velocity
    whole, made = _felt(machine, joint, names, columns, bodies)
    rotor = np.concatenate([one.acceleration[:, own] for one in bodies])
    shares = rotor @ made / max(float(rotor @ rotor), 1e-300)
    alike = np.sqrt(np.mean((made - np.outer(rotor, shares)) ** 2, axis=0)) <= FAINT * whole
    alike &= shares > 0.0
    return {
        name: float(share) / _unit(machine, name)
        for name, share, one in zip(names, shares, alike, strict=True)
        if one and name in links
    }


def _felt(
    machine: Machine, joint: str, names: Sequence[str], columns: Sequence[Array], bodies: Sequence[BodyMotion]
) -> tuple[float, Array]:
    """Size (rms) of the force that the body asks of a joint, and what links do to that (n, p): a mass and a payload as heavy as their link, an
    inertia as large as that about the hinge."""
    own = machine.body.joints[joint].velocity
    whole = np.concatenate([one.force[:, own] for one in bodies])
    made = np.concatenate([one[:, own] for one in columns]) * [_unit(machine, name) for name in names]
    return float(np.sqrt(np.mean(whole**2))), made


def _unit(machine: Machine, name: str) -> float:
    """The size at which a parameter of a link is looked at."""
    link, kind = split(name)
    return machine.body.about_hinge(link) if kind == TURNING else machine.body.parameters[f"{link}.{MASS}"]


def _motion(
    machine: Machine, model: Model, joint: str, body: BodyMotion, columns: Mapping[str, Array]
) -> Motion:
    own = machine.body.joints[joint]
    x, v, a = body.pose[:, own.position], body.rate[:, own.velocity], body.acceleration[:, own.velocity]
    stretch, known = body.stretch, machine.body.parameters
    effort = np.zeros(len(x))
    if joint in stretch.effort:
        effort = _decimated(body, stretch.effort[joint])
    found = {
        f"{BODY}.{link}": (known[link], np.ascontiguousarray(column[:, own.velocity]))
        for link, column in columns.items()
    }
    others = {
        name: body.rate[:, machine.body.joints[name].velocity] for name in machine.joints if name != joint
    }
    motion = Motion(
        stretch.record, stretch.name, body.time, x, v, a, x, v, effort, body.period,
        coupling=body.force[:, own.velocity] - model.mass.value * a, links=found, others=others,
    )  # fmt: skip
    if joint not in stretch.reference:
        return motion
    motion = replace(motion, reference=_reference(machine, joint, body))
    return _later(motion, model, 0.0)


def _reference(machine: Machine, joint: str, body: BodyMotion) -> Reference:
    """The reference of a joint's controller, which works at the body's step."""
    stretch, step = body.stretch, machine.body.step
    held = 0.0 if joint in stretch.smooth else stretch.period
    forward = stretch.forward.get(joint)
    return Reference(
        stretch.reference[joint],
        stretch.part,
        None if forward is None else _decimated(body, forward),
        0.5 * (held - step),
        step,
        1.0 / (FINER * body.period),
        body.every,
    )


def _decimated(body: BodyMotion, signal: Array) -> Array:
    """A signal at a stretch's samples as one at the motion's."""
    return low_pass(signal, body.stretch.period, 1.0 / (FINER * body.period))[:: body.every]


def _bandwidth(motions: Sequence[Motion], cut: float, dominant: float) -> Bandwidth:
    """The bandwidth of a joint's effort beside what the rest of the body asks for."""
    own = [
        replace(one, effort=one.effort - (0.0 if one.coupling is None else one.coupling)) for one in motions
    ]
    return bandwidth_below(own, cut, dominant)
