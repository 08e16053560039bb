"""What a signal was some steps ago."""

import math

from numba import njit


@njit("float64(float64[:, ::1], int64, int64, float64)", cache=True, error_model="numpy")
def earlier(past, column, now, steps):
    """Value `steps` before step `now` of a column, between steps on a straight line; before the first it was as there.

    The rows go round: row k % n holds step k, so that n - 1 steps back are known.
    """
    at = max(now - max(steps, 0.0), 0.0)
    step, rows = math.floor(at), past.shape[0]
    if step >= now:
        return past[now % rows, column]
    share = at - step
    before, after = past[step % rows, column], past[(step + 1) % rows, column]
    return before + share * (after - before)
