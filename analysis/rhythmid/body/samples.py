"""What is measured between the steps of a run: positions on the cubic through positions and speeds, all else on straight lines; an effort
also as its mean, as drives report it.

A held reference jumps at the stamp of a sample, and the effort with it. An effort taken at that instant is ahead of what acts between the
samples by half a period, in the reference alone: an analysis would read it as damping and inertia that the joint has not (a controller's gain
times half a period). The mean over the period before a stamp is late by half a period in all its parts alike, like any measurement.
"""

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


@njit(
    "void(float64[:, ::1], int64, float64, float64, float64, float64[:, ::1], float64[:, ::1])",
    cache=True,
    error_model="numpy",
)
def mean_efforts(rows, first, begin, step, span, times, out):
    """Mean effort, `out` (n, joints), over the `span` [s] before times (n, joints) [s]; before the run it is what it is at its begin.

    A step holds its effort, and the order of the sum does not depend on where `rows` begin: all chunks give the same bits.
    """
    for i in range(times.shape[0]):
        for j in range(times.shape[1]):
            last, end = place_of(times[i, j], begin, step)
            number, start = place_of(times[i, j] - span, begin, step)
            total = 0.0
            for k in range(int(number), int(last)):
                total += rows[max(k, 0) - first, 4 * j + 3]
            total += end * rows[int(last) - first, 4 * j + 3]
            total -= start * rows[max(int(number), 0) - first, 4 * j + 3]
            out[i, j] = total / (last + end - number - start)
