"""The motion of a whole body, and the forces that it requires."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.joints.joint_stretch import JointStretch

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motions of one stretch: pose, rate and acceleration (n, nv) of the whole body below the cut of its filter, and the
    forces (n, nv) that they require. Where gears yield, `rigid` is the motion of the encoders."""

    stretch: JointStretch
    time: Array
    pose: Array
    rate: Array
    acceleration: Array
    force: Array
    period: float
    every: int
    rigid: "BodyMotion | None" = None
