"""Angles of an orientation that a message gives as a quaternion: `pose.orientation.yaw` is read from its x, y, z and w.

They are those of REP 103, in rad: roll about x, then pitch about y, then yaw about z, all of the fixed frame. Pitch is within a quarter of
a turn either way, and beyond it roll and yaw change by half a turn instead.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ANGLES = ("roll", "pitch", "yaw")
PARTS = ("x", "y", "z", "w")
SHORTEST = 0.5  # least length of a quaternion that was set; an orientation that nobody set is four zeros


def is_orientation(fields: Mapping[str, Any]) -> bool:
    """Whether a message with these fields is a quaternion."""
    return set(fields) == set(PARTS)


def angle_of(name: str, parts: Array) -> Array:
    """The angle (n,) [rad] called `name` of quaternions (4, n) in the order x, y, z, w; NaN where one was not set."""
    length = np.linalg.norm(parts, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = np.where(length > SHORTEST, parts / length, np.nan)
        if name == "roll":
            return np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        if name == "pitch":
            return np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
