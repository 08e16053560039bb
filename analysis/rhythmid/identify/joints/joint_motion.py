"""Motion of several joints for inverse dynamics: each joint's own motion, and the force that the rest of the body
requires.

Along joint j the body requires m_j a_j + c_j. Here m_j is the inertia of the joint's path, and the coupling c_j is
the rest of the whole body's inverse dynamics (linear in the inertial parameters: M. Gautier, W. Khalil, Int. J.
Robot. Res. 11 (1992) 362). So each joint has the balance of a machine with one axis, with the same elements.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

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
from rhythmid.identify.joints.body_motion import BodyMotion
from rhythmid.identify.joints.elastic_gear import ElasticGear, deflected
from rhythmid.identify.joints.joint_balance import JointBalance
from rhythmid.identify.joints.joint_stretch import JointStretch, joint_stretches
from rhythmid.model import Model, Term
from rhythmid.record.joint_record import JointRecord, Taken
from rhythmid.value import Value

Array = NDArray[np.float64]
# cut-off periods at both ends of a stretch in which the filter's transient is several times the noise (measured on
# flights between contacts)
CLEAR = 1.5
FAINT = 1e-3  # share of a joint's effort below which the effect of a link on it is neglected


def nothing(t):
    """Zero force, for the term that holds the body's parameters: their force is in the coupling."""
    return 0.0


@dataclass(frozen=True, eq=False)
class JointBalances:
    """The effort balances of all joints: each joint's path as a model with one axis, and its motions.

    `computed` are the joints whose effort is computed from the reference and their controller's known gains.
    `leads` [s] of other joints are the leads of references in their recorded efforts, already removed from the
    motions. `rotor_like` holds by joint the link parameters with the same effect there as the rotor's inertia, with
    the inertia [kg m²] per unit of each. `refuted` holds pairs of a joint and a link's parameter that is not freed
    there, because the other joints refute its estimate. `aligned` [s] are the standard deviations of the alignments of joints. `gears` are the joints whose gears yield: there `bodies` are the
    motions of the links, and `motions` those of the encoders.
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
    gears: Mapping[str, ElasticGear] = field(default_factory=dict)
    aligned: Mapping[str, float] = field(default_factory=dict)
    # of these balances alone: a copy with other motions has none
    _made: dict[tuple[str, float], Balance] = field(init=False, default_factory=dict, repr=False)

    @classmethod
    def of(
        cls,
        machine: Machine,
        records: Sequence[JointRecord],
        alike: "JointBalances | None" = None,
    ) -> "JointBalances":
        """The balances of these records, with the filters of `alike` and without the same leads. Raises InputError
        where the records are too short.

        The forces at each joint are those of `alike`, too, unless payloads or centres of mass are at other places, or gravity differs.
        """
        stretches = joint_stretches(machine, records)
        cut, dominant = (alike.cut, alike.dominant) if alike else cut_of(machine, stretches)
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
            # the force that a controller commands enters its actuator
            computed = joint in stretches[0].reference
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
            else {joint: bandwidth_below(motions[joint], cut, dominant) for joint in machine.joints}
        )
        computed = tuple(joint for joint in machine.joints if joint in stretches[0].reference)
        made = cls(
            machine, models, motions, bandwidths, bodies, period, computed, rotor_like=rotor_like, refuted=refuted,
            aligned=alike.aligned if alike else {},
        )  # fmt: skip
        return made.with_leads(alike.leads).with_gears(alike.gears) if alike else made

    def with_leads(self, leads: Mapping[str, float]) -> "JointBalances":
        """The balances after removing these leads [s] of the references from the recorded efforts."""
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

    def with_gears(self, gears: Mapping[str, ElasticGear], columns: bool = True) -> "JointBalances":
        """The balances with these gears in place of its own; without new `columns` the effects of links' values stay."""
        if not gears and not self.gears:
            return self
        rigid = [one.rigid or one for one in self.bodies]
        bodies = deflected(self, rigid, gears)
        motions = {}
        for joint, made in self.motions.items():
            own, inertia = self.machine.body.joints[joint].velocity, self.models[joint].mass.value
            motions[joint] = [
                replace(
                    motion,
                    coupling=body.force[:, own] - inertia * motion.acceleration,
                    links=_links_along(self.machine, own, motion, body) if columns else motion.links,
                )
                for motion, body in zip(made, bodies, strict=True)
            ]
        return replace(self, motions=motions, bodies=bodies, gears=dict(gears))

    def without(self, joint: str, parameter: str) -> "JointBalances":
        """The balances in which the search at a joint does not free a parameter of a link."""
        return replace(self, refuted=self.refuted | {(joint, parameter)})

    @property
    def refuted_links(self) -> frozenset[tuple[str, str]]:
        """Pairs of a joint and a link of which parameters are refuted there."""
        return frozenset((joint, split(name)[0]) for joint, name in self.refuted)

    def links(self, joint: str) -> tuple[str, ...]:
        """Links to whose mass and inertia a joint is sensitive, as "link.mass" and "link.inertia", and those to
        whose payload it would be, as "link.payload"."""
        return tuple(name.removeprefix(f"{BODY}.") for name in self.motions[joint][0].links)

    def rotors(self, joint: str) -> tuple[str, ...]:
        """Link parameters with the same effect at a joint as its rotor's inertia; they are bounded above."""
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
        """The balance of one joint whose reference acts `late` [s] after its timestamp; the same at each call, with what is
        known of it. Raises InputError where too few samples are left."""
        if (joint, late) not in self._made:
            motions = self.motions[joint]
            if late != 0.0:
                motions = [_later(motion, self.models[joint], late) for motion in motions]
            made = JointBalance.of_motions(motions, self.bandwidths[joint], self.period, CLEAR)
            self._made[joint, late] = replace(made, aligned=self.aligned.get(joint))
        return self._made[joint, late]


def _links_along(
    machine: Machine, own: int, motion: Motion, body: BodyMotion
) -> dict[str, tuple[float, Array]]:
    """The effects of links' values on one velocity, along the motion of the links."""
    names = [name.removeprefix(f"{BODY}.") for name in motion.links]
    columns = machine.body.columns(names, body.pose, body.rate, body.acceleration)[:, own]
    return {
        name: (taken, np.ascontiguousarray(column))
        for (name, (taken, _)), column in zip(motion.links.items(), columns.T, strict=True)
    }


def _later(motion: Motion, model: Model, late: float) -> Motion:
    """A motion whose reference acts `late` [s] later; a motion without a reference is unchanged."""
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
    """The path of a joint as a model with one axis; masses, inertias and payloads of links are parameters of a term
    `body`.

    The actuator is left out where the effort was recorded after it. A mass or inertia in `rotors` has the same
    effect as the rotor's inertia. Its upper bound is the given value minus the equivalent of the whole rotor: any
    smaller change is attributed to the rotor, which files of robots seldom state well. Parameters that are `held`
    are no candidates.
    """
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
    # a rotor's inertia is not negative
    least = max(path.mass.value - known[f"{joint}.armature"], 0.0)
    free = armature is not None and not armature.fixed
    mass = replace(path.mass, fixed=not free, bounds=(least, np.inf))
    return replace(path, mass=mass, terms=(*terms, Term(element, BODY, values)))


def cut_of(machine: Machine, stretches: Sequence[JointStretch]) -> tuple[float, float]:
    """Highest frequency [Hz] of the fastest joint's motion, and the strongest frequency [Hz] of all joints."""
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


def sampled(stretch: JointStretch, cut: float) -> tuple[int, Array, Array, Array, Array]:
    """The number of samples of a stretch of which one is kept, and there its time (n,), pose, rate and acceleration (n, nv) below the cut."""
    every = max(1, int(1.0 / (FINER * cut * stretch.period)))
    time = stretch.time[::every]
    pose = low_pass(stretch.pose, stretch.period, cut)[::every]
    rate = CubicSpline(time, pose).derivative()(time)
    return every, time, pose, rate, CubicSpline(time, rate).derivative()(time)


def _body_motion(machine: Machine, stretch: JointStretch, cut: float) -> BodyMotion:
    every, time, pose, rate, acceleration = sampled(stretch, cut)
    force = machine.body.inverse(pose, rate, acceleration)
    return BodyMotion(stretch, time, pose, rate, acceleration, force, stretch.period * every, every)


def _same_places(one: Machine, other: Machine) -> bool:
    """Whether the payloads and the centres of mass of two machines are at the same places of their links, under the same gravity."""
    places = (
        (one.body.ends, other.body.ends),
        (one.body.centres, other.body.centres),
        (one.body.replaced, other.body.replaced),
    )
    return np.array_equal(one.body.gravity, other.body.gravity) and all(
        first.keys() == second.keys() and all(np.array_equal(first[link], second[link]) for link in first)
        for first, second in places
    )


def _links(
    machine: Machine, joint: str, names: Sequence[str], columns: Sequence[Array], bodies: Sequence[BodyMotion]
) -> tuple[str, ...]:
    """Masses and inertias of links to which a joint is sensitive, and the payloads to which it would be if they
    were as heavy as their links."""
    whole, made = _felt(machine, joint, names, columns, bodies)
    felt = np.sqrt(np.mean(made**2, axis=0)) > FAINT * whole
    return tuple(name for name, one in zip(names, felt, strict=True) if one)


def _rotors(
    machine: Machine, joint: str, links: Sequence[str], names: Sequence[str], columns: Sequence[Array],
    bodies: Sequence[BodyMotion],
) -> dict[str, float]:  # fmt: skip
    """Those of these parameters with the same effect at a joint as its rotor's inertia, with the inertia per unit
    of each."""
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
    """Size (rms) of the force that the body requires at a joint, and the effects of links on it (n, p): of a mass,
    of a payload as heavy as its link, and of an inertia as large as that about the hinge."""
    own = machine.body.joints[joint].velocity
    whole = np.concatenate([one.force[:, own] for one in bodies])
    made = np.concatenate([one[:, own] for one in columns]) * [_unit(machine, name) for name in names]
    return float(np.sqrt(np.mean(whole**2))), made


def _unit(machine: Machine, name: str) -> float:
    """Reference size of a link's parameter."""
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
    """The reference of a joint's controller, which runs at the body's time step."""
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
    """A signal at a stretch's samples, decimated to the motion's samples."""
    return low_pass(signal, body.stretch.period, 1.0 / (FINER * body.period))[:: body.every]
