"""A free map: a force that is a smooth function of the speed in either direction, of position, and of friction
under load.

It represents effects for which the catalogue has no element. The splines are local and constant beyond the data:
splines that extrapolate diverge in blocks whose data reach further than the fitted ones.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from rhythmid.identify.inverse_dynamics.motion import Motion

Array = NDArray[np.float64]
PIECES = 6  # pieces of a spline over the speed: enough for a Stribeck minimum
PLACES = 10  # pieces of a spline over the position: enough for a hardening, a kink or the sine of one turn
DEGREE = 3
REACH = (0.01, 0.99)  # quantiles of the data that limit a spline's pieces


class Spline:
    """Columns of a smooth function over the bulk of the given values (n,), clipped beyond it: a straight line, and cubic
    B-splines in the form in which a ridge on their coefficients is a penalty on curvature (P. H. C. Eilers, B. D. Marx,
    Statistical Science 11 (1996) 89; as mixed models: I. D. Currie, M. Durban, Stat. Modelling 2 (2002) 333)."""

    def __init__(self, values: Array, pieces: int) -> None:
        low, high = np.quantile(values, REACH)
        high = high if high > low else low + max(abs(low), 1.0) * 1e-9
        # knots halfway between even spacing and quantiles: quantiles alone leave one piece for the high speeds
        even = np.linspace(low, high, pieces + 1)
        knots = 0.5 * (even + np.quantile(np.clip(values, low, high), np.linspace(0.0, 1.0, pieces + 1)))
        self.low, self.high = float(low), float(high)
        self.knots = np.concatenate([np.full(DEGREE, low), knots, np.full(DEGREE, high)])
        bends = np.diff(np.eye(pieces + DEGREE), 2, axis=0)
        self.shape = bends.T @ np.linalg.inv(bends @ bends.T)  # from second differences to coefficients

    @property
    def count(self) -> int:
        """Number of columns: two of the straight line, then the curved ones."""
        return 2 + self.shape.shape[1]

    def __call__(self, values: Array) -> Array:
        """Columns (n, count): 1, the value scaled to −1 … 1, and the curved columns."""
        inside = np.clip(values, self.low, self.high)
        straight = (2.0 * inside - self.low - self.high) / (self.high - self.low)
        bent = np.asarray(BSpline.design_matrix(inside, self.knots, DEGREE).toarray()) @ self.shape
        return np.column_stack([np.ones(len(inside)), straight, bent])


class FreeMap:
    """Columns of a free map over the motions: a spline of the speed for each direction, a spline of the position,
    and sgn(v) times the position, its square, and the load. `bends` (q,) marks columns whose coefficients are
    curvature.

    The load is a share of `size`, the size of the effort. A joint `beside` this one adds splines of its speed and
    of the sum and the difference of the two speeds: a belt or a differential gear on the way to the motor turns
    with both.
    """

    def __init__(self, motions: list[Motion], size: float = 1.0, beside: str | None = None) -> None:
        position = np.concatenate([motion.leg_position for motion in motions])
        self._beside, self._size = beside, size
        speeds = zip(*(self._speeds_of(motion) for motion in motions), strict=True)
        self._speeds = [_two_sided(np.concatenate(one)) for one in speeds]
        self._position = Spline(position, PLACES)
        self._centre, self._width = float(np.mean(position)), float(np.std(position)) or 1.0
        bends = [np.arange(spline.count) > 1 for sides in self._speeds for spline, _ in sides]
        self._first = 1 if bends else 0  # the constant is already the sum of two columns
        bends += [(np.arange(self._position.count) > 1)[self._first :], np.zeros(3, bool)]
        self.bends = np.concatenate(bends)

    def _speeds_of(self, motion: Motion) -> list[Array]:
        own = motion.leg_velocity
        if self._beside is None:
            return [own]
        other = motion.others[self._beside]
        return [own, other, own + other, own - other]

    def columns(self, motion: Motion, load: Array) -> Array:
        """Columns (n, q) of one motion; `load` (n,) is the predicted effort, never the measured one."""
        sign = np.sign(motion.leg_velocity)
        found = [
            spline(direction * speed) * (direction * speed > 0.0)[:, None]
            for speed, sides in zip(self._speeds_of(motion), self._speeds, strict=True)
            for spline, direction in sides
        ]
        found.append(self._position(motion.leg_position)[:, self._first :])
        place = np.clip((motion.leg_position - self._centre) / self._width, -3.0, 3.0)
        found.append(np.column_stack([sign * place, sign * place**2, sign * np.abs(load) / self._size]))
        return np.hstack(found)


def _two_sided(speed: Array) -> list[tuple[Spline, float]]:
    """A spline of the speed (n,) for each direction with enough samples."""
    sides = ((speed[speed > 0.0], 1.0), (-speed[speed < 0.0], -1.0))
    return [(Spline(one, PIECES), direction) for one, direction in sides if len(one) > 4 * PIECES]
