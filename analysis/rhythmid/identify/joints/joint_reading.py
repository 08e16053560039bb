"""Readings of recorded joints (their order, units and signs), and the effort residuals that a body leaves under each.

The dynamics of a body are sensitive to a wrong reading: gravity depends on the angles, and the motion of one joint
acts on the others. So the force of the file's body is computed along the motion under a reading. Each joint's
effort is fitted with this force and with losses that no file states: a rotor, a damper, dry friction and a spring,
all nonnegative, and a constant. A wrong sign of an effort would need negative losses.
"""

import copy
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from rhythmid.body.inertial_parameter import ARMATURE
from rhythmid.body.machine import Machine
from rhythmid.identify.inverse_dynamics.motion import low_pass
from rhythmid.identify.joints.joint_motion import CLEAR, cut_of, sampled
from rhythmid.identify.joints.joint_stretch import TOUCHING_DISTANCE, JointStretch, joint_stretches
from rhythmid.identify.least_squares import column_norms
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
POSES = 300  # number of poses at which readings are compared
FEW = 60  # least number of poses without contact for a reading
NEIGHBOURS = 3  # poses within the filter's length at which contact is checked
LOSSES = ("damper", "dry friction", "spring", "rotor")  # of each joint, beside gravity
REWEIGHTED = 3  # times that joints are weighted again by the residuals of their efforts: more change no digit that is written
LEAST_SHARE = 0.02  # least relative residual used as a weight: the noise of a good sensor
TINY = 1e-12  # [N or N*m] standard deviation of an effort that is zero throughout
FLOOR = 0.01  # share of an effort below which residuals are not compared further
LONGEST = 60.0  # [s] length of a record that is used, from its start


@dataclass(frozen=True)
class Reading:
    """One reading of a joint: its motion is recorded as that of joint number `source`, its effort as that of number `driven`, with factors for both.

    An effort that was not recorded follows from the positions and has their factor.
    """

    source: int
    driven: int
    position: float = 1.0
    effort: float = 1.0

    @property
    def place(self) -> tuple[int, int]:
        """The joints as which motion and effort are recorded."""
        return self.source, self.driven


@dataclass(frozen=True)
class Balanced:
    """Effort residual of a joint as a share of the effort's variation, and the `gain` of the effort over the force
    that the body requires. `bare` is the residual with a spring, a damper and dry friction alone."""

    left: float
    gain: float = 1.0
    bare: float = 1.0

    @property
    def told(self) -> float:
        """The share of the effort's power that the body explains, of what losses by themselves leave."""
        return max(0.0, 1.0 - (self.left / self.bare) ** 2) if self.bare > 0.0 else 0.0


def mean_left(balanced: Iterable[Balanced]) -> float:
    """Mean logarithm of what is left of the efforts: one joint that comes right counts, whatever the others do."""
    return float(np.mean([math.log(one.left + FLOOR) for one in balanced]))


@dataclass(frozen=True, eq=False)
class Seen:
    """Poses (n, nq), rates and accelerations (n, nv), and the effort (n,) of each joint under a reading."""

    pose: Array
    rate: Array
    acceleration: Array
    effort: tuple[Array, ...]


class RecordedMotion:
    """Poses of a record and the efforts at them, for any reading of the driven joints.

    With `touching`, poses that are in contact under a reading are left out. Without it, contact is not checked,
    which takes a fifth of the time.
    """

    def __init__(self, machine: Machine, record: JointRecord, touching: bool = False) -> None:
        start, end = record.span
        part = record.cut(start, min(end, start + LONGEST))
        body = machine.body
        self.joints = machine.joints
        self.body, self._touching = body, touching
        # contact is checked for each reading: with degrees taken for radians the feet are anywhere
        stretches = joint_stretches(replace(machine, body=replace(body, contacts=False)), [part])
        self.computed = tuple(joint for joint in self.joints if joint in stretches[0].reference)
        cut, _ = cut_of(machine, stretches)
        found = [_sampled(machine, one, cut) for one in stretches]
        every = max(1, sum(len(one.pose) for one in found) // POSES)
        self._pose, self._rate, self._acceleration, self._effort = (
            np.concatenate([getattr(one, name)[::every] for one in found])
            for name in ("pose", "rate", "acceleration", "effort")
        )
        # poses before and after each, within the filter's length
        near = [_near(len(one.pose), one.period, cut) for one in found]
        self._beside = [
            np.concatenate([one.pose[at[::every]] for one, at in zip(found, ats, strict=True)])
            for ats in zip(*near, strict=True)
        ]
        own = [body.joints[joint] for joint in self.joints]
        self._positions, self._velocities = [one.position for one in own], [one.velocity for one in own]
        self.rotational = tuple(one.rotational for one in own)
        self._armature = [body.parameters[f"{joint}.{ARMATURE}"] for joint in self.joints]

    @cached_property
    def as_declared(self) -> tuple[Reading, ...]:
        """The reading declared in signals.yaml."""
        return tuple(Reading(k, k) for k in range(len(self.joints)))

    def balanced(self, readings: tuple[Reading, ...], free: bool = False) -> tuple[Balanced, ...]:
        """Effort residuals of each joint under a reading; with `free`, efforts may be in any unit."""
        seen = self.seen(readings)
        if seen is None:
            return tuple(Balanced(1.0) for _ in readings)
        return self._balanced(seen, self.body.inverse(seen.pose, seen.rate, seen.acceleration), free)

    def _balanced(self, seen: "Seen", force: Array, free: bool) -> tuple[Balanced, ...]:
        """Effort residuals of each joint beside a `force` (n, nv) that the body requires."""
        return tuple(
            _fitted(effort, force[:, own] - rotor * a, x, v, a, free)
            for effort, own, rotor, (x, v, a) in zip(
                seen.effort, self._velocities, self._armature, self._along(seen), strict=True
            )
        )

    def mounted(self, gravity: Array) -> "RecordedMotion":
        """The same motion of a body on which gravity (3,) [m/s^2] acts."""
        made = copy.copy(self)
        made.body = self.body.with_gravity(gravity)
        return made

    def gravity(self) -> Array:
        """The gravity (3,) [m/s^2] under which least is left of the efforts of all joints as they are declared."""
        seen = self.seen(self.as_declared)
        if seen is None:
            return self.body.gravity
        motion = seen.pose, seen.rate, seen.acceleration
        without = self.body.with_gravity(np.zeros(3)).inverse(*motion)
        weight = np.stack([self.body.with_gravity(axis).inverse(*motion) - without for axis in np.eye(3)])
        return self._shared_numbers(seen, without, weight)

    def loaded(self, link: str) -> tuple[Balanced, ...] | None:
        """Effort residuals of each joint as declared where a link carries the body with which least is left of all; None where it would be lighter,
        or heavier than the machine: none carries more than it weighs."""
        seen = self.seen(self.as_declared)
        if seen is None:
            return None
        motion = seen.pose, seen.rate, seen.acceleration
        force = self.body.inverse(*motion)
        columns = np.moveaxis(self.body.inertial_columns(link, *motion), 2, 0)
        added = self._shared_numbers(seen, force, columns)
        if not 0.0 < added[0] <= sum(self.body.own(one).mass for one in self.body.links):
            return None
        return self._balanced(seen, force + np.tensordot(added, columns, axes=1), False)

    def _shared_numbers(self, seen: "Seen", force: Array, weights: Array) -> Array:
        """The numbers (p,) that all joints share and with which least is left of their efforts: beside a `force` (n, nv) that does not depend on
        them, they act with `weights` (p, n, nv)."""
        found, share = np.zeros(len(weights)), np.ones(len(self.joints))
        for _ in range(REWEIGHTED):
            made = [
                (_columns(weights[:, :, own].T, x, v, a), effort - force[:, own] + rotor * a)
                for effort, own, rotor, (x, v, a) in zip(
                    seen.effort, self._velocities, self._armature, self._along(seen), strict=True
                )
            ]
            scale = share * np.array([max(float(np.std(one)), TINY) for one in seen.effort])
            found, left = _shared(made, scale)
            share = np.maximum(left / scale * share, LEAST_SHARE)
        return found

    def seen(self, readings: tuple[Reading, ...]) -> "Seen | None":
        """The motion and the efforts under a reading, poses in contact left out; None where these are too many."""
        sources = [one.source for one in readings]
        factors = np.array([one.position for one in readings])
        clear = np.ones(len(self._pose), dtype=bool)
        if self._touching:
            beside = self._read(np.concatenate(self._beside), self._positions, sources, factors)
            touched = self.body.touches(beside, TOUCHING_DISTANCE).reshape(len(self._beside), -1)
            clear = ~np.any(touched, axis=0)
        if clear.sum() < min(FEW, len(clear)):
            return None
        pose = self._read(self._pose[clear], self._positions, sources, factors)
        rate, acceleration = (
            self._read(one[clear], self._velocities, sources, factors)
            for one in (self._rate, self._acceleration)
        )
        effort = [
            (one.position if joint in self.computed else one.effort) * self._effort[clear, one.driven]
            for joint, one in zip(self.joints, readings, strict=True)
        ]
        return Seen(pose, rate, acceleration, tuple(effort))

    def _along(self, seen: "Seen") -> list[tuple[Array, Array, Array]]:
        """Position, velocity and acceleration (n,) of each joint."""
        return [
            (seen.pose[:, at], seen.rate[:, own], seen.acceleration[:, own])
            for at, own in zip(self._positions, self._velocities, strict=True)
        ]

    @staticmethod
    def _read(values: Array, places: list[int], sources: list[int], factors: Array) -> Array:
        made = values.copy()
        made[:, places] = factors * values[:, [places[k] for k in sources]]
        return made


def _fitted(effort: Array, asked: Array, x: Array, v: Array, a: Array, free: bool) -> Balanced:
    """Residual of an effort (n,) after a fit of the force that the body requires and of losses."""
    losses = np.column_stack([v, np.sign(v), x])
    columns = np.column_stack([losses, a, asked]) if free else np.column_stack([losses, a])
    if np.ptp(effort) == 0.0 or not np.all(np.isfinite(asked)):
        return Balanced(1.0)
    values, left = _without_sign(columns, effort if free else effort - asked)
    _, bare = _without_sign(losses, effort)
    size = float(np.std(effort))
    return Balanced(min(left / size, 1.0), float(values[-1]) if free else 1.0, min(bare / size, 1.0))


def _columns(weight: Array, x: Array, v: Array, a: Array) -> Array:
    """Columns (n, 2 p + 4) for a joint: the effects (n, p) of shared numbers either way, and its losses and rotor."""
    return np.column_stack([weight, -weight, v, np.sign(v), x, a])


def _shared(joints: Sequence[tuple[Array, Array]], scale: Array) -> tuple[Array, Array]:
    """Numbers (p,) that all joints share, and the rms left at each; `joints` are columns and what is wanted, to be divided by `scale`."""
    own = len(LOSSES)
    both = joints[0][0].shape[1] - own
    whole = np.zeros((sum(len(wanted) for _, wanted in joints), both + own * len(joints)))
    wanted = np.zeros(len(whole))
    begin, parts = 0, []
    for place, ((columns, one), size) in enumerate(zip(joints, scale, strict=True)):
        part = slice(begin, begin := begin + len(one))
        centred = (columns - columns.mean(axis=0)) / size
        whole[part, :both] = centred[:, :both]
        whole[part, both + own * place : both + own * (place + 1)] = centred[:, both:]
        wanted[part] = (one - one.mean()) / size
        parts.append(part)
    norms = column_norms(whole)
    values, _ = nnls(whole / norms, wanted)
    values = values / norms
    missed = wanted - whole @ values
    left = np.array([float(np.sqrt(np.mean(missed[part] ** 2))) for part in parts]) * scale
    return values[: both // 2] - values[both // 2 : both], left


def _without_sign(columns: Array, wanted: Array) -> tuple[Array, float]:
    """Nonnegative factors (p,) of the columns (n, p) that fit `wanted` (n,) best together with a constant, and the
    rms residual."""
    columns, wanted = columns - columns.mean(axis=0), wanted - wanted.mean()
    norms = column_norms(columns)
    values, missed = nnls(columns / norms, wanted)
    return values / norms, float(missed) / math.sqrt(len(wanted))


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Poses, rates, accelerations (n, nv) and efforts (n, joints) of a stretch below the cut-off, at intervals
    `period` [s]."""

    pose: Array
    rate: Array
    acceleration: Array
    effort: Array
    period: float


def _sampled(machine: Machine, stretch: JointStretch, cut: float) -> _Sampled:
    every, _, pose, rate, acceleration = sampled(stretch, cut)
    effort = np.column_stack(
        [_effort(machine.paths[joint], joint, stretch, place) for joint, place in _places(machine)]
    )
    effort = low_pass(effort, stretch.period, cut)[::every]
    return _Sampled(pose, rate, acceleration, effort, stretch.period * every)


def _places(machine: Machine) -> list[tuple[str, int]]:
    return [(joint, machine.body.joints[joint].position) for joint in machine.joints]


def _effort(model: Model, joint: str, stretch: JointStretch, place: int) -> Array:
    """Effort (n,) of a joint as recorded, or as computed from the reference and its controller's known gains."""
    if joint in stretch.effort:
        return stretch.effort[joint]
    x = stretch.pose[:, place]
    v = np.gradient(x, stretch.time)
    commanded, total = stretch.reference[joint], np.zeros(len(x))
    asked = np.interp(stretch.time - commanded.late(model), commanded.time, commanded.passed(model))
    for term in model.terms:
        if term.element.acts == "feedback" and term.element.kernel is not None:
            total = term.element.kernel(asked, x, v, stretch.time, **term.numbers)
    return total + stretch.forward.get(joint, 0.0)


def _near(length: int, period: float, cut: float) -> tuple[NDArray[np.intp], ...]:
    """For each sample of a stretch, the indices of itself and of samples within the filter's length on either side."""
    reach = math.ceil(CLEAR / (cut * period))
    steps = np.unique(np.linspace(-reach, reach, NEIGHBOURS).astype(int))
    return tuple(np.clip(np.arange(length) + step, 0, length - 1) for step in steps)
