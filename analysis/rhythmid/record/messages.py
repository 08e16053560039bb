"""Messages of one topic as arrays: sensor_msgs/JointState with one joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Messages:
    """Header stamps [ns] and the fields present, each of shape (n,): position [m], velocity [m/s], effort [N];
    `receive_ns` is when a recorder got them (the stamps, where nothing else is known)."""

    stamp_ns: NDArray[np.int64]
    position: NDArray[np.float64] | None = None
    velocity: NDArray[np.float64] | None = None
    effort: NDArray[np.float64] | None = None
    receive_ns: NDArray[np.int64] | None = None
