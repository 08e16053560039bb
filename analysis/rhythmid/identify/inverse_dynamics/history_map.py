"""A free function of the motion and its past, for effects that no sum of curves over single quantities can represent.

The force at a joint depends on several quantities at once. With play and hysteresis it depends on the last turning
points, too. The function is a Gaussian process of position, velocity, acceleration, load, and the states of stop
operators of three widths, which remember the last turning points (M. Brokate, J. Sprekels, Hysteresis and Phase
Transitions, Springer, 1996, ch. 2). It is reduced to a number of centres among the rows (C. K. I. Williams, M.
Seeger, Using the Nyström method to speed up kernel machines, NIPS 13, 2000).
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.distance import cdist

from rhythmid.identify.inverse_dynamics.motion import Motion

Array = NDArray[np.float64]
# widths of the stops, in standard deviations of the position: presliding, play, a soft transmission
WIDTHS = (0.02, 0.1, 0.4)
CENTRES = 80  # a record has some hundred rows: about as many as its columns can distinguish
# length scale of the function, in standard deviations of each quantity: 1.5 to 3 were best for large and small residuals
LENGTH = 2.0
# added to the diagonal of the kernel matrix of the centres, for conditioning when centres are close
JITTER = 1e-6
DISTINCT_STDS = 4.0  # standard deviations at which quantities of other records are clipped


@njit("float64[::1](float64[::1], float64)", cache=True)
def stop(position: Array, width: float) -> Array:
    """State (n,) of a stop operator, from −1 to 1: it follows the position up to a distance `width` from the last
    turning point."""
    state = np.empty_like(position)
    state[0] = 0.0
    for k in range(1, len(position)):
        moved = state[k - 1] + (position[k] - position[k - 1]) / width
        state[k] = min(max(moved, -1.0), 1.0)
    return state


class HistoryMap:
    """Columns of the function over motions.

    `places` are the rows of each motion from which the centres are chosen, `loads` (n,) the predicted efforts,
    never the measured ones. Every column is scaled like a curved column of a free map.
    """

    def __init__(
        self, motions: Sequence[Motion], places: Sequence[NDArray[np.int64]], loads: Sequence[Array]
    ) -> None:
        self._travel = float(np.std(np.concatenate([motion.leg_position for motion in motions]))) or 1.0
        rows = np.vstack(
            [self._quantities(m, load)[p] for m, load, p in zip(motions, loads, places, strict=True)]
        )
        self._middle, self._spread = rows.mean(axis=0), rows.std(axis=0)
        self._spread[self._spread == 0.0] = 1.0
        some = np.random.default_rng(0).choice(len(rows), min(CENTRES, len(rows)), replace=False)
        self._centres = self._scaled(rows[some])
        within = self._kernel(self._centres) + JITTER * np.eye(len(some))
        self._root = cholesky(within, lower=True)
        self.bends = np.ones(len(some), dtype=bool)

    def _quantities(self, motion: Motion, load: Array) -> Array:
        place = np.ascontiguousarray(motion.leg_position, dtype=float)
        stops = [stop(place, width * self._travel) for width in WIDTHS]
        return np.column_stack([place, motion.leg_velocity, motion.acceleration, load, *stops])

    def _scaled(self, quantities: Array) -> Array:
        return np.clip((quantities - self._middle) / self._spread, -DISTINCT_STDS, DISTINCT_STDS)

    def _kernel(self, scaled: Array) -> Array:
        return np.exp(-0.5 * cdist(scaled, self._centres, "sqeuclidean") / LENGTH**2)

    def columns(self, motion: Motion, load: Array) -> Array:
        """Columns (n, q) of one motion; independent coefficients of equal variance give the process."""
        found = self._kernel(self._scaled(self._quantities(motion, load)))
        return solve_triangular(self._root, found.T, lower=True).T
