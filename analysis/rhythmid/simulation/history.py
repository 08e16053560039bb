"""What signals of a simulation were some time ago, kept step by step for the elements that ask for it.

A row a step: its begin [s], its length [s], whether signals may jump where it begins, then for each signal its values at the
step's begin, middle and end, which a parabola joins. Jumps so stay jumps. The row behind the last whole step belongs to the
step under way. A delay shorter than what of that step has passed is read off a parabola through the present value, with the
slope that the signal had as the step began: so the value is smooth in the delay down to zero, where it is the present one.

The text of these functions is compiled once into a module of its own, which generated ones import.
"""
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false

import numpy as np

BEGIN, LENGTH, JUMP, SIGNALS = 0, 1, 2, 3  # columns; three a signal from the last on


def row_at(past, row, last, delay, time):
    """Row that `time` - `delay` falls into, or begins, searched from `row` on."""
    while row < last and past[row + 1, 0] + delay <= time:
        row += 1
    return row


def row_until(past, row, last, delay, time):
    """Row that `time` - `delay` falls into, or ends."""
    while row < last and past[row + 1, 0] + delay < time:
        row += 1
    return row


def jump_until(past, row, last, delay, until):
    """When a jump comes through the delay for the first time after `row`, `until` where none does before."""
    for k in range(row + 1, last + 1):
        if past[k, 0] + delay >= until:
            break
        if past[k, 2] != 0.0:
            return past[k, 0] + delay
    return until


def earlier(past, row, last, column, at, now):
    """Value b and share s that make up the signal at time `at`: b + s (z - b), with z the signal at `now`."""
    a = past[row, column]
    if row < last:
        x = (at - past[row, 0]) / past[row, 1]
        b, c = past[row, column + 1], past[row, column + 2]
        return a + x * (4.0 * b - 3.0 * a - c + 2.0 * x * (a + c - 2.0 * b)), 0.0
    if at >= now:
        return a, 1.0
    x = (at - past[row, 0]) / (now - past[row, 0])
    if row == 0 or past[row, 2] != 0.0:
        return a, x
    b, c = past[row - 1, column + 1], past[row - 1, column + 2]
    slope = (past[row - 1, column] - 4.0 * b + 3.0 * c) / past[row - 1, 1]
    return a + x / (1.0 + x) * (now - past[row, 0]) * slope, x * x


def began(past, last, time, jumps):
    """Begin the row `last` at `time`, unless it begins there already; a jump there is not forgotten."""
    if past[last, 0] != time:
        past[last, 0] = time
        past[last, 2] = 0.0
    if jumps:
        past[last, 2] = 1.0


def with_room(past, oldest, last):
    """The rows from `oldest` to `last`, with room for more."""
    kept = last + 1 - oldest
    roomy = np.zeros((max(2 * kept, 64), past.shape[1]))
    roomy[:kept] = past[oldest : last + 1]
    return roomy
