"""Mounting of a base that differs from the file, such as an arm on a wall: found from the weight in the efforts of all joints.

The efforts of a body are linear in the acceleration of gravity in the frame of its base, three numbers that all joints share. No gravity at
all means that the controller's compensation of gravity is not in the recorded efforts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.robot_file import FIXED
from rhythmid.identify.joints.joint_reading import Balanced, RecordedMotion, mean_left

STANDARD = 9.81  # [m/s^2] where the file has no gravity (MuJoCo's own value)
LEAST_GRAVITY = 0.2  # share of gravity below which the estimate counts as none: unmodelled masses weigh less
OFF_AXIS = 0.05  # least fall of the mean logarithm of the residuals for a direction along no axis instead of the nearest axis


@dataclass(frozen=True, eq=False)
class Mounting:
    """Gravity (3,) [m/s^2] in the frame of the base, and the effort residuals of each joint under it."""

    gravity: NDArray[np.float64]
    left: tuple[Balanced, ...]

    def words(self) -> str:
        """The entry to write and its reason, as one clause."""
        vector = ", ".join(f"{float(format(one, '.3g')):g}" for one in self.gravity + 0.0)
        written = f"gravity: [{vector}]  under 'body:' in the model's file"
        if not self.gravity.any():
            return f"the efforts seem to be without the weight of the links, as those beyond a compensation of gravity are; write  {written}"
        return f"the base seems to be mounted otherwise than the body's file says; write  {written}"


def likely_mounting(motion: RecordedMotion) -> Mounting | None:
    """The mounting with the smallest effort residuals; None for a base that moves."""
    body = motion.body
    found = motion.gravity() if body.base == FIXED else None
    if found is None or not np.all(np.isfinite(found)):
        return None
    given = float(np.linalg.norm(body.gravity)) or STANDARD
    size = float(np.linalg.norm(found))
    if size < LEAST_GRAVITY * given:
        return _under(motion, np.zeros(3))
    free = _under(motion, found / size * given)
    axis = np.zeros(3)
    axis[np.argmax(np.abs(found))] = np.copysign(given, found[np.argmax(np.abs(found))])
    near = _under(motion, axis)
    return near if mean_left(near.left) < mean_left(free.left) + OFF_AXIS else free


def _under(motion: RecordedMotion, gravity: NDArray[np.float64]) -> Mounting:
    return Mounting(gravity, motion.mounted(gravity).balanced(motion.as_declared))
