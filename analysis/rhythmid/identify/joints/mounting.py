"""A base that is mounted otherwise than its file says, as an arm on a wall: found by the weight in the efforts of all joints.

The efforts of a body are linear in the acceleration of gravity in the frame of its base, three numbers that all joints share. Where another direction
of it explains the efforts and the file's does not, the model is told. None at all is what efforts tell from which a controller has taken
the weight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.robot_file import FIXED
from rhythmid.identify.joints.joint_reading import Balanced, RecordedMotion, mean_left

STANDARD = 9.81  # [m/s^2] where the file has no gravity (MuJoCo's own value)
LEAST = 0.2  # of gravity, below which what is found is none: the weight of what a file does not show is not so large
SNAPPED = 0.05  # mean logarithm of what is left, by which a direction along no axis has to be better than the nearest axis


@dataclass(frozen=True, eq=False)
class Mounting:
    """Gravity (3,) [m/s^2] in the frame of the base, and what is left of each joint's effort under it."""

    gravity: NDArray[np.float64]
    left: tuple[Balanced, ...]

    def words(self) -> str:
        """What is to be written, and why, as one clause."""
        vector = ", ".join(f"{float(format(one, '.3g')):g}" for one in self.gravity + 0.0)
        written = f"gravity: [{vector}]  under 'body:' in the model's file"
        if not self.gravity.any():
            return f"the efforts seem to be without the weight of the links, as those beyond a compensation of gravity are; write  {written}"
        return f"the base seems to be mounted otherwise than the body's file says; write  {written}"


def likely_mounting(motion: RecordedMotion) -> Mounting | None:
    """The mounting under which least is left of the efforts; None for a base that moves."""
    body = motion.body
    found = motion.gravity() if body.base == FIXED else None
    if found is None or not np.all(np.isfinite(found)):
        return None
    given = float(np.linalg.norm(body.gravity)) or STANDARD
    size = float(np.linalg.norm(found))
    if size < LEAST * given:
        return _under(motion, np.zeros(3))
    free = _under(motion, found / size * given)
    axis = np.zeros(3)
    axis[np.argmax(np.abs(found))] = np.copysign(given, found[np.argmax(np.abs(found))])
    near = _under(motion, axis)
    return near if mean_left(near.left) < mean_left(free.left) + SNAPPED else free


def _under(motion: RecordedMotion, gravity: NDArray[np.float64]) -> Mounting:
    return Mounting(gravity, motion.mounted(gravity).balanced(motion.as_declared))
