"""A step of the input with which a record begins: the value before the step follows from the rest of the machine.

A dead time is visible where the input changes. Of a step with the first sample only the later value is recorded. If the machine is at rest
at first and moves later, the earlier value is known as well: an effort was zero, a reference was equal to the output.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.record.record import Record
from rhythmid.record.rounding import resolution
from rhythmid.simulation.signal import Hold, continuous, zero_order_hold

Array = NDArray[np.float64]
HISTORY = 1.0  # [s] length of the history before the first sample: the longest delay that is sought
FIRST_INTERVALS = 3  # number of intervals from which rest at the start is decided
REST_SPEED = 0.2  # largest speed at rest, relative to the rms speed of the whole record; that of a running machine is 1
# least size of the first step, relative to the span of the input afterwards: 0.5 for a wave that begins at its peak, 1 for a pulse
LEAST_STEP = 0.75
# least step of the position from which a speed is computed, in standard deviations of its noise
CLEAR_STEP = 8.0


def value_before(record: Record) -> float | None:
    """Value of the input [its unit] before its first sample, if that was a step; None if there is no sign of a step."""
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
    if first == 0.0 or first < LEAST_STEP * later or not starts_from_rest(record):
        return None
    return before


def stepped(record: Record, before: float) -> PPoly:
    """The input of a record with this value before its first sample."""
    assert record.input is not None
    time, value = record.input.time, record.input.value
    begin = time[0] - HISTORY
    if np.ptp(value) == 0.0:
        return zero_order_hold(np.array([begin, time[0]]), np.array([before, value[0]]))
    # a step is not band-limited
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
    """Whether the output is slow in its first samples compared with the whole record; False for an acceleration."""
    value = record.output.value
    if record.output_kind == "acceleration" or not np.isfinite(value).all():
        return False
    speed = np.abs(value) if record.output_kind == "velocity" else _speeds(value)
    if len(speed) <= FIRST_INTERVALS:
        return False
    size = float(np.sqrt(np.mean(speed**2)))
    return size > 0.0 and float(np.median(speed[:FIRST_INTERVALS])) < REST_SPEED * size


def _speeds(value: Array) -> Array:
    """Steps (m,) of a position over so many samples that they exceed its noise and rounding; empty if there are none."""
    noise = float(np.sqrt(np.mean(np.diff(value, 2) ** 2) / 6.0)) if len(value) > 2 else 0.0
    least = CLEAR_STEP * max(noise, resolution(value) / np.sqrt(12.0))
    apart = 1
    while apart <= len(value) // (2 * FIRST_INTERVALS):
        steps = np.abs(value[apart:] - value[:-apart])[::apart]
        if float(np.sqrt(np.mean(steps**2))) > least:
            return steps
        apart *= 2
    return np.zeros(0)
