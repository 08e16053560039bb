"""What is measured between the steps of a run: positions on the cubic through positions and speeds, all else on straight lines."""

import math

from numba import njit

ON_STEP = 1e-6  # of a step: a time that near to a step's begin is meant to be there


@njit("UniTuple(float64, 2)(float64, float64, float64)", cache=True, error_model="numpy")
def place_of(time, begin, step):
    """Number of the step in which a time lies, and the share of it that has gone."""
    steps = (time - begin) / step
    nearest = math.floor(steps + 0.5)
    if abs(steps - nearest) < ON_STEP:
        return float(nearest), 0.0
    return float(math.floor(steps)), steps - math.floor(steps)


@njit(
    "void(float64[:, ::1], int64, float64, float64, float64[:, ::1], float64[:, :, ::1])",
    cache=True,
    error_model="numpy",
)
def sample_joints(rows, first, begin, step, times, out):
    """Position, velocity, sensor's output and effort, `out` (4, n, joints), at times (n, joints) [s].

    `rows` are what the stepping tells at its steps from the number `first` on: for each joint these four.
    """
    for i in range(times.shape[0]):
        for j in range(times.shape[1]):
            number, share = place_of(times[i, j], begin, step)
            k = int(number) - first
            if share == 0.0:
                for c in range(4):
                    out[c, i, j] = rows[k, 4 * j + c]
                continue
            for c in range(1, 4):
                here = rows[k, 4 * j + c]
                out[c, i, j] = here + share * (rows[k + 1, 4 * j + c] - here)
            x, y = rows[k, 4 * j], rows[k + 1, 4 * j]
            v, w = step * rows[k, 4 * j + 1], step * rows[k + 1, 4 * j + 1]
            bend, twist = 3.0 * (y - x) - 2.0 * v - w, v + w - 2.0 * (y - x)
            out[0, i, j] = x + share * (v + share * (bend + share * twist))


@njit(
    "void(float64[:, ::1], int64, int64, float64, float64, float64[::1], float64[:, ::1])",
    cache=True,
    error_model="numpy",
)
def sample_columns(rows, from_column, first, begin, step, times, out):
    """The columns of the rows from `from_column` on, `out` (n, columns), at times (n,) [s]."""
    for i in range(times.shape[0]):
        number, share = place_of(times[i], begin, step)
        k = int(number) - first
        for c in range(out.shape[1]):
            here = rows[k, from_column + c]
            out[i, c] = here if share == 0.0 else here + share * (rows[k + 1, from_column + c] - here)
