"""Past values of a signal."""

import math

from numba import njit


@njit("float64(float64[:, ::1], int64, int64, float64)", cache=True, error_model="numpy")
def earlier(past, column, now, steps):
    """Value of a column `steps` before step `now`, by linear interpolation between steps; before the first step its
    first value.

    The rows form a ring buffer: row k % n holds step k, so n - 1 steps back are available.
    """
    at = max(now - max(steps, 0.0), 0.0)
    step, rows = math.floor(at), past.shape[0]
    if step >= now:
        return past[now % rows, column]
    share = at - step
    before, after = past[step % rows, column], past[(step + 1) % rows, column]
    return before + share * (after - before)
