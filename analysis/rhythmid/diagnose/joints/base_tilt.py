"""A base that is tilted against its file: the direction of gravity as one cause that all joints share.

The efforts are linear in the acceleration of gravity in the frame of the base (M. Gautier, W. Khalil, Int. J. Robot. Res. 11 (1992) 362). Its
size is known, so that two angles are left, which all joints together determine. They compete with the laws of the joints, such as a
pendulum's gravity or a spring, which each joint needs for itself where the base is tilted.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.robot_file import FREE
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.constants import CONTRADICTS
from rhythmid.diagnose.joints.joint_case import JointResult
from rhythmid.diagnose.joints.linear_cause import LinearCause
from rhythmid.diagnose.joints.machine_cause import Columns, WeightedRows, rows_of, worth_it
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.model import Model
from rhythmid.record.joint_record import JointRecord
from rhythmid.report.quantity import with_std

Array = NDArray[np.float64]
# [rad] prior standard deviation of an angle that is not known at all: that of a uniform angle
ANY = math.pi / math.sqrt(3.0)
# [rad] standard deviation from which an angle is not determined: no tilt, of up to a right angle, would then contradict the file
UNDETERMINED = 0.5 * math.pi / CONTRADICTS
ANGLES = 2  # of a direction


@dataclass(frozen=True, eq=False)
class BaseTilt:
    """The direction of gravity in the frame of the base as it fits the efforts of all joints.

    `angles` (k,) [rad] are rotations of gravity towards the `directions` (k, 3), unit vectors across the file's `given` gravity (3,) [m/s^2],
    with their `covariance` (k, k); k is 1 where the efforts do not say of the other direction, and `open` (3,) is that direction.
    `weight` is the log odds of all joints for it, from which the `probability` follows, `shown` the joint that shows it best.
    """

    given: Array
    directions: Array
    angles: Array
    covariance: Array
    open: Array | None
    weight: float
    probability: float = math.nan
    shown: str = ""

    @property
    def gravity(self) -> Array:
        """Gravity (3,) [m/s^2] in the frame of the base."""
        return turned(self.given, self.directions, self.angles)

    @property
    def angle(self) -> Estimate:
        """The angle [deg] between this gravity and the file's."""
        size = float(np.linalg.norm(self.angles))
        slope = self.angles / size if size > 0.0 else np.zeros(len(self.angles))
        std = math.sqrt(max(float(slope @ self.covariance @ slope), 0.0))
        return Estimate(math.degrees(size), math.degrees(std), "deg")

    @property
    def moved(self) -> bool:
        """Whether the records contradict the file's direction."""
        angle = self.angle
        return angle.std is not None and angle.value > CONTRADICTS * angle.std

    @property
    def values(self) -> dict[str, Estimate]:
        """The angle, and the components of gravity, with no standard deviation where the records do not determine one."""
        slopes = _slopes(self.given, self.directions, self.angles)
        std = np.sqrt(np.maximum(np.diag(slopes @ self.covariance @ slopes.T), 0.0))
        found = {"angle": self.angle}
        for axis, value, spread, own in zip("xyz", self.gravity + 0.0, std, self._open(), strict=True):
            found[axis] = Estimate(float(value), None if own else float(spread), "m/s^2")
        return found

    def _open(self) -> NDArray[np.bool_]:
        """Components (3,) that a turn in the direction left open would change by more than the others are known."""
        return np.zeros(3, dtype=bool) if self.open is None else np.abs(self.open) > math.sin(UNDETERMINED)

    @property
    def words(self) -> str:
        """The tilt and what to write, as one clause."""
        angle = self.angle
        vector = ", ".join(f"{float(format(one, '.4g')):g}" for one in np.round(self.gravity, 3) + 0.0)
        said = f"the base is tilted by {with_std(angle.value, angle.std)}° (gravity [{vector}])"
        said += f"; write  gravity: [{vector}]  under 'body:' in model.yaml"
        if self.open is None:
            return said
        axis = ", ".join(f"{one:.2g}" for one in np.round(self.open, 2) + 0.0)
        return f"{said}; a tilt towards [{axis}] is not determined by these efforts"


def turned(given: Array, directions: Array, angles: Array) -> Array:
    """A gravity (3,) after a rotation by these angles (k,) [rad] towards unit vectors (k, 3) across it."""
    size, angle = float(np.linalg.norm(given)), float(np.linalg.norm(angles))
    if angle == 0.0:
        return given.copy()
    return math.cos(angle) * given + size * math.sin(angle) / angle * (angles @ directions)


def _slopes(given: Array, directions: Array, angles: Array) -> Array:
    """Derivative (3, k) of the turned gravity with respect to the angles."""
    step = 1e-6
    sides = [
        turned(given, directions, angles + one) - turned(given, directions, angles - one)
        for one in step * np.eye(len(angles))
    ]
    return np.array(sides).reshape(len(angles), 3).T / (2.0 * step)


@dataclass(frozen=True, eq=False)
class _Turn(LinearCause):
    """Gravity turned towards `directions` (k, 3), as a cause of the machine as a whole; `weights` are the efforts per unit of gravity."""

    directions: Array
    least: float = -math.inf

    @property
    def given(self) -> Array:
        return self.balances.machine.body.gravity

    @property
    def spreads(self) -> Array:
        return np.full(len(self.directions), ANY)

    @property
    def slopes(self) -> Array:
        return float(np.linalg.norm(self.given)) * self.directions

    def coordinates(self, numbers: Array) -> Array:
        return turned(self.given, self.directions, numbers) - self.given

    def in_place(self, numbers: Array, paths: Mapping[str, Model]) -> JointBalances:
        gravity = turned(self.given, self.directions, numbers)
        return JointBalances.of(self.balances.machine.with_gravity(gravity), self.records, self.balances)


def likely_tilt(
    balances: JointBalances, records: Sequence[JointRecord], found: Mapping[str, JointResult]
) -> BaseTilt | None:
    """The tilt of the base that all joints together give decisively more than the laws found at each of them; None without one."""
    body = balances.machine.body
    if body.base == FREE or not np.any(body.gravity) or not found:
        return None
    weights = weights_per_unit(balances)
    rows = [
        rows_of(one.result.search.balance, one.result.nominal.fit, weights[joint])
        for joint, one in found.items()
    ]
    directions, undetermined = directions_of(rows, body.gravity)
    if not len(directions):
        return None
    best = worth_it(_Turn(balances, records, weights, directions), balances, found)
    if best is None:
        return None
    tilt = BaseTilt(
        body.gravity, directions, best.numbers, best.covariance, undetermined, best.weight, best.probability, best.shown
    )  # fmt: skip
    return tilt if tilt.moved else None


def weights_per_unit(balances: JointBalances) -> Columns:
    """By joint, the effort (n, 3) along each motion that one m/s^2 of gravity along each axis asks for."""
    body = balances.machine.body
    found: Columns = {joint: [] for joint in balances.models}
    without = body.with_gravity(np.zeros(3))
    along = [body.with_gravity(axis) for axis in np.eye(3)]
    for motion in balances.bodies:
        still = np.zeros_like(motion.rate)
        rest = without.inverse(motion.pose, still, still)
        columns = np.stack([one.inverse(motion.pose, still, still) - rest for one in along], axis=2)
        for joint, made in found.items():
            made.append(columns[:, body.joints[joint].velocity])
    return found


def directions_of(rows: Sequence[WeightedRows], given: Array) -> tuple[Array, Array | None]:
    """The directions (k, 3) across gravity in which the efforts determine a tilt, and the one in which they do not, if there is one."""
    size = float(np.linalg.norm(given))
    _, _, axes = np.linalg.svd(given[None, :] / size)
    across = axes[1:]
    information = np.zeros((ANGLES, ANGLES))
    for _, columns in rows:
        own = size * columns @ across.T
        information += own.T @ own
    values, turns = np.linalg.eigh(information)
    known = values > UNDETERMINED**-2
    directions = turns.T @ across
    missing = directions[~known]
    return directions[known], missing[0] if len(missing) == 1 else None
