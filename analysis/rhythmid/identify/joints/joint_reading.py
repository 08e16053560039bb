"""Readings of recorded joints (their order, units and signs), and the effort residuals that a body leaves under each.

The dynamics of a body are sensitive to a wrong reading: gravity depends on the angles, and the motion of one joint
acts on the others. So the force of the file's body is computed along the motion under a reading. Each joint's
effort is fitted with this force and with losses that no file states: a rotor, a damper, dry friction and a spring,
all nonnegative, and a constant. A wrong sign of an effort would need negative losses.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import nnls

from rhythmid.body.inertial_parameter import ARMATURE
from rhythmid.body.machine import Machine
from rhythmid.identify.inverse_dynamics.bandwidth import bandwidth_of_motion
from rhythmid.identify.inverse_dynamics.motion import FINER, Stretch, low_pass
from rhythmid.identify.joints.joint_motion import CLEAR
from rhythmid.identify.joints.joint_stretch import TOUCHING_DISTANCE, JointStretch, joint_stretches
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord

Array = NDArray[np.float64]
POSES = 300  # number of poses at which readings are compared
FEW = 60  # least number of poses without contact for a reading
NEIGHBOURS = 3  # poses within the filter's length at which contact is checked
LONGEST = 60.0  # [s] length of a record that is used, from its start


@dataclass(frozen=True)
class Reading:
    """One reading of a joint: recorded as joint number `source`, with factors for its position and its effort.

    An effort that was not recorded follows from the positions and has their factor.
    """

    source: int
    position: float = 1.0
    effort: float = 1.0


@dataclass(frozen=True)
class Balanced:
    """Effort residual of a joint as a share of the effort's variation, and the `gain` of the effort over the force
    that the body requires. `bare` is the residual with a spring, a damper and dry friction alone."""

    left: float
    gain: float = 1.0
    bare: float = 1.0


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
        cut = _cut(machine, stretches)
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
        return tuple(Reading(k) for k in range(len(self.joints)))

    def balanced(self, readings: tuple[Reading, ...], free: bool = False) -> tuple[Balanced, ...]:
        """Effort residuals of each joint under a reading; with `free`, efforts may be in any unit."""
        sources = [one.source for one in readings]
        factors = np.array([one.position for one in readings])
        clear = np.ones(len(self._pose), dtype=bool)
        if self._touching:
            beside = self._read(np.concatenate(self._beside), self._positions, sources, factors)
            touched = self.body.touches(beside, TOUCHING_DISTANCE).reshape(len(self._beside), -1)
            clear = ~np.any(touched, axis=0)
        if clear.sum() < min(FEW, len(clear)):
            return tuple(Balanced(1.0) for _ in readings)
        pose = self._read(self._pose[clear], self._positions, sources, factors)
        rate, acceleration = (
            self._read(one[clear], self._velocities, sources, factors)
            for one in (self._rate, self._acceleration)
        )
        force = self.body.inverse(pose, rate, acceleration)
        found = []
        for place, one in enumerate(readings):
            factor = one.position if self.joints[place] in self.computed else one.effort
            own, a = self._velocities[place], acceleration[:, self._velocities[place]]
            asked = force[:, own] - self._armature[place] * a  # without the rotor, which is fitted
            effort = factor * self._effort[clear, one.source]
            found.append(_fitted(effort, asked, pose[:, self._positions[place]], rate[:, own], a, free))
        return tuple(found)

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


def _without_sign(columns: Array, wanted: Array) -> tuple[Array, float]:
    """Nonnegative factors (p,) of the columns (n, p) that fit `wanted` (n,) best together with a constant, and the
    rms residual."""
    columns, wanted = columns - columns.mean(axis=0), wanted - wanted.mean()
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    values, missed = nnls(columns / norms, wanted)
    return values / norms, float(missed) / math.sqrt(len(wanted))


def _cut(machine: Machine, stretches: list[JointStretch]) -> float:
    """Highest frequency [Hz] of the fastest joint's motion."""
    found = []
    for joint in machine.joints:
        place = machine.body.joints[joint].position
        raw = [
            Stretch(s.record, s.name, s.time, s.pose[:, place], s.time, s.period, "force", "position")
            for s in stretches
        ]
        found.append(bandwidth_of_motion(raw)[0])
    return max(found)


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
    every = max(1, int(1.0 / (FINER * cut * stretch.period)))
    time = stretch.time[::every]
    pose = low_pass(stretch.pose, stretch.period, cut)[::every]
    rate = CubicSpline(time, pose).derivative()(time)
    acceleration = CubicSpline(time, rate).derivative()(time)
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
