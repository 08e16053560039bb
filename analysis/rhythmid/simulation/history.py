"""Past values of signals in a simulation, stored step by step for the elements that need them.

There is one row per step: its start [s], its length [s], whether signals may jump at its start, then for each
signal the values at start, middle and end of the step, which a parabola interpolates. So jumps are preserved. The
row after the last complete step belongs to the current step. A delay shorter than the elapsed part of that step is
evaluated on a parabola through the present value, with the signal's slope at the start of the step. So the value is
continuous in the delay down to zero, where it is the present one.

The text of these functions is compiled once into its own module, which generated modules import.
"""
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false

import numpy as np

BEGIN, LENGTH, JUMP, SIGNALS = 0, 1, 2, 3  # columns; three per signal from the last on


def row_at(past, row, last, delay, time):
    """Row in which `time` - `delay` lies or with which it starts, searched from `row` on."""
    while row < last and past[row + 1, 0] + delay <= time:
        row += 1
    return row


def row_until(past, row, last, delay, time):
    """Row in which `time` - `delay` lies or with which it ends."""
    while row < last and past[row + 1, 0] + delay < time:
        row += 1
    return row


def jump_until(past, row, last, delay, until):
    """Time at which the first jump after `row` arrives through the delay; `until` where none is earlier."""
    for k in range(row + 1, last + 1):
        if past[k, 0] + delay >= until:
            break
        if past[k, 2] != 0.0:
            return past[k, 0] + delay
    return until


def earlier(past, row, last, column, at, now):
    """Value b and share s of the signal at time `at`: b + s (z - b), with z the signal at `now`."""
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
    """Start the row `last` at `time`, unless it already starts there; an earlier jump there is kept."""
    if past[last, 0] != time:
        past[last, 0] = time
        past[last, 2] = 0.0
    if jumps:
        past[last, 2] = 1.0


def with_room(past, oldest, last):
    """The rows from `oldest` to `last`, with space for more; loops, for a slice takes seconds to compile."""
    kept = last + 1 - oldest
    roomy = np.zeros((max(2 * kept, 64), past.shape[1]))
    for row in range(kept):
        for column in range(past.shape[1]):
            roomy[row, column] = past[oldest + row, column]
    return roomy
