"""What a signal was some steps ago."""

import math

from numba import njit


@njit("float64(float64[:, ::1], int64, int64, float64)", cache=True, error_model="numpy")
def earlier(past, column, now, steps):
    """Value `steps` before row `now` of a column, between rows on a straight line; before the first row it was as there."""
    at = max(now - max(steps, 0.0), 0.0)
    row = math.floor(at)
    if row >= now:
        return past[now, column]
    share = at - row
    return past[row, column] + share * (past[row + 1, column] - past[row, column])
