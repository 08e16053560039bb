"""A free map: any force that is a smooth function of speed in either direction, of position, and of friction under load.

It stands for physics without a name. Splines are local and end flat where the data end: unbounded ones diverge in blocks that
reach further than those that they were fitted to.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from rhythmid.identify.inverse_dynamics.motion import Motion

Array = NDArray[np.float64]
PIECES = (
    6  # of each spline: enough for a hardening, a kink or a Stribeck fall (fit to sin over a turn: 0.2 %)
)
DEGREE = 3
REACH = (0.01, 0.99)  # quantiles of the data between which a spline has its pieces


class Spline:
    """A basis of cubic B-splines over the bulk of the given values (n,), clipped beyond it."""

    def __init__(self, values: Array, pieces: int = PIECES) -> None:
        low, high = np.quantile(values, REACH)
        high = high if high > low else low + max(abs(low), 1.0) * 1e-9
        # half of the way towards equal numbers of samples: quantiles alone leave the fast ends to one piece
        even = np.linspace(low, high, pieces + 1)
        knots = 0.5 * (even + np.quantile(np.clip(values, low, high), np.linspace(0.0, 1.0, pieces + 1)))
        self.low, self.high = float(low), float(high)
        self.knots = np.concatenate([np.full(DEGREE, low), knots, np.full(DEGREE, high)])
        self.count = pieces + DEGREE

    def __call__(self, values: Array) -> Array:
        """Values (n, count) of the basis functions; they add up to 1."""
        inside = np.clip(values, self.low, self.high)
        return np.asarray(BSpline.design_matrix(inside, self.knots, DEGREE).toarray())


class FreeMap:
    """Columns of a free map over the motions: a spline of the speed for each direction, one of the position, and
    sgn(v) times the load, position and its square."""

    def __init__(self, motions: list[Motion]) -> None:
        velocity = np.concatenate([motion.leg_velocity for motion in motions])
        position = np.concatenate([motion.leg_position for motion in motions])
        forwards, backwards = velocity[velocity > 0.0], -velocity[velocity < 0.0]
        self._forwards = Spline(forwards) if len(forwards) > PIECES else None
        self._backwards = Spline(backwards) if len(backwards) > PIECES else None
        self._position = Spline(position)
        self._centre, self._width = float(np.mean(position)), float(np.std(position)) or 1.0

    def columns(self, motion: Motion, load: Array) -> Array:
        """Columns (n, q) of one motion; `load` (n,) is the effort that a model predicts, never the measured one."""
        velocity, sign = motion.leg_velocity, np.sign(motion.leg_velocity)
        found = [self._position(motion.leg_position)]
        for spline, direction in ((self._forwards, 1.0), (self._backwards, -1.0)):
            if spline is not None:
                moving = direction * velocity > 0.0
                found.append(spline(direction * velocity) * moving[:, None])
        place = np.clip((motion.leg_position - self._centre) / self._width, -3.0, 3.0)
        found.append(np.column_stack([sign * place, sign * place**2, sign * np.abs(load)]))
        return np.hstack(found)
