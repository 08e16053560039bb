"""A step of the input that was made as the record began: a machine at rest shows what was there before the first sample.

A dead time shows where the input changes. Of a recorded change both sides are known; of one that was made with the first sample only the
later one is. A machine that rests as the record begins, and moves later, tells the other: an effort was zero, a reference was where the
output is.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.record.record import Record
from rhythmid.record.rounding import resolution
from rhythmid.simulation.signal import Hold, continuous, zero_order_hold

Array = NDArray[np.float64]
HISTORY = (
    1.0  # [s] before the first sample for which a value before it is told: the longest delay that is sought
)
FIRST = 3  # intervals by which it is told whether a machine starts from rest
SLOW = (
    0.2  # of the speed of the whole record, rms, that it then has at most: a machine that runs has all of it
)
# of the span of all that the input does later, that the first step has at least: a wave that begins at its peak has half, a pulse all of it
LARGE = 0.75
CLEAR = 8.0  # standard deviations of the noise, that a step of the position has at least from which a speed is told


def value_before(record: Record) -> float | None:
    """Value of the input [its unit] before its first sample, which was a step from there; None where nothing tells of such a step."""
    given = record.input
    if given is None or len(given) < 2 or record.forcing is not None or not _begins_together(record):
        return None
    if record.input_kind == "force":
        before = 0.0
    elif record.input_kind == "reference" and given.unit == record.output.unit:
        before = float(record.output.value[0])
    else:
        return None
    first = abs(float(given.value[0]) - before)
    later = float(np.ptp(given.value))
    if first == 0.0 or first < LARGE * later or not starts_from_rest(record):
        return None
    return before


def stepped(record: Record, before: float) -> PPoly:
    """The input of a record with this value before its first sample."""
    assert record.input is not None
    time, value = record.input.time, record.input.value
    begin = time[0] - HISTORY
    if np.ptp(value) == 0.0:
        return zero_order_hold(np.array([begin, time[0]]), np.array([before, value[0]]))
    # what jumps as it begins is not band-limited
    hold: Hold = "zero" if record.hold == "zero" else "linear"
    later = continuous(time, value, hold)
    first = np.zeros((len(later.c), 1))
    first[-1] = before
    return PPoly(np.hstack([first, later.c]), np.concatenate([[begin], later.x]), extrapolate=True)


def _begins_together(record: Record) -> bool:
    """Whether the input begins with the output, not before it or later."""
    assert record.input is not None
    return abs(float(record.input.time[0] - record.output.time[0])) <= record.output.period


def starts_from_rest(record: Record) -> bool:
    """Whether the output is slow in its first samples beside what it becomes; never of an acceleration."""
    value = record.output.value
    if record.output_kind == "acceleration" or not np.isfinite(value).all():
        return False
    speed = np.abs(value) if record.output_kind == "velocity" else _speeds(value)
    if len(speed) <= FIRST:
        return False
    size = float(np.sqrt(np.mean(speed**2)))
    return size > 0.0 and float(np.median(speed[:FIRST])) < SLOW * size


def _speeds(value: Array) -> Array:
    """Steps (m,) of a position over so many samples that they stand clear of its noise and rounding; empty where none does."""
    noise = float(np.sqrt(np.mean(np.diff(value, 2) ** 2) / 6.0)) if len(value) > 2 else 0.0
    least = CLEAR * max(noise, resolution(value) / np.sqrt(12.0))
    apart = 1
    while apart <= len(value) // (2 * FIRST):
        steps = np.abs(value[apart:] - value[:-apart])[::apart]
        if float(np.sqrt(np.mean(steps**2))) > least:
            return steps
        apart *= 2
    return np.zeros(0)
