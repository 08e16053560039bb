"""Samples between the steps of a run: cubic interpolation of positions by positions and speeds, linear
interpolation of all else, and the mean effort that drives report.

A held reference jumps at the stamp of a sample, and the effort with it. An effort sampled at that instant leads the
mean effort between samples by half a period, but only in the part due to the reference. An analysis would interpret
this as additional damping and inertia of the joint (a controller's gain times half a period). The mean over the
period before a stamp is delayed by half a period in all its parts, like any measurement.
"""

import math

from numba import njit

ON_STEP = 1e-6  # in steps: a time that close to a step's start is taken as that start


@njit("UniTuple(float64, 2)(float64, float64, float64)", cache=True, error_model="numpy")
def place_of(time, begin, step):
    """Number of the step that contains a time, and the elapsed share of that step."""
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
    """Position, velocity, sensor output and effort, `out` (4, n, joints), at times (n, joints) [s].

    `rows` hold these four quantities of each joint for the steps from the number `first` on.
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
    """Mean effort, `out` (n, joints), over the `span` [s] before times (n, joints) [s]; before the run its initial
    value is used.

    A step holds its effort. The order of the sum does not depend on where `rows` begin, so the result is bitwise
    equal for any chunks.
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
