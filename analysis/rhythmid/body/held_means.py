"""Means of held signals over the steps of an integration, identical for one call and for several partial calls."""

from numba import njit


@njit(
    "void(float64[:, :], float64[:, :], float64[::1], float64[::1], float64[:, ::1])",
    cache=True,
    error_model="numpy",
)
def held_means(knots, level, edges, before, out):
    """Mean over each step of signals that hold `level` (k, joints) from their knots (k, joints) [s] on, and
    `before` (joints,) until the first knot. `edges` (n + 1,) [s] are the starts of the steps and the end of the
    last, `out` (n, joints) the result."""
    count = knots.shape[0]
    for j in range(out.shape[1]):
        following = 0  # first knot after the step's start
        value = before[j]
        for k in range(out.shape[0]):
            while following < count and knots[following, j] <= edges[k]:
                value = level[following, j]
                following += 1
            begin, total, bent = edges[k], 0.0, False
            while following < count and knots[following, j] < edges[k + 1]:
                total += value * (knots[following, j] - begin)
                begin, value, bent = knots[following, j], level[following, j], True
                following += 1
            out[k, j] = (
                (total + value * (edges[k + 1] - begin)) / (edges[k + 1] - edges[k]) if bent else value
            )
