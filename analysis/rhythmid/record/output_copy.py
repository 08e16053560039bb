"""Channels that are copies of the output: the same sensor in volts and millimetres, or the effort of a controller
that holds a position."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel, Record

Array = NDArray[np.float64]
SAME = 0.999  # correlation without lag above which a channel may be the output in another unit
SAME_STEPS = 0.99  # the same for their steps: a merely correlated channel has its own noise


def correlation_of_copy(one: Array, output: Array, steps: tuple[float, float]) -> float:
    """Correlation of a channel with the output (n,) at the same times where it is an affine copy, including noise;
    else 0.

    `steps` are the rounding steps of the two. Rounding lowers the correlation of the steps of a copy. Then it
    counts as a copy where the two differ by no more than the rounding.
    """
    if len(one) < 3:
        return 0.0
    at_once = _correlation(one, output)
    if abs(at_once) <= SAME:
        return 0.0
    slope, offset = np.polyfit(one, output, 1)
    apart = float(np.std(output - slope * one - offset))
    rounded = abs(slope) * steps[0] + steps[1]
    return (
        at_once if apart <= rounded or abs(_correlation(np.diff(one), np.diff(output))) > SAME_STEPS else 0.0
    )


def smallest_step(value: Array) -> float:
    """Rounding step of values, if they are rounded: the smallest difference between two of them."""
    steps = np.diff(np.unique(value[np.isfinite(value)]))
    return float(steps.min()) if len(steps) else 0.0


def doubt_of_copy(correlation: float) -> str:
    """Message about a copy of the output that is declared as a driving channel."""
    return (
        f"it is a copy of the output (correlation {correlation:+.5f} at once): what a controller makes while its reference "
        "stands still, or the same motion in another unit"
    )


def copy_notes(record: Record) -> list[str]:
    """A line on each effort that is the output times a negative number: a spring of the machine would need a
    positive one."""
    found: list[str] = []
    for role, channel in (("input", record.input), ("effort", record.effort)):
        if channel is None or (role == "input" and record.input_kind != "force"):
            continue
        correlation = correlation_of_copy(*_at_once(channel, record.output))
        if correlation < 0.0:
            found.append(
                f"{role}: {doubt_of_copy(correlation)}; it describes that controller, not the machine"
            )
    return found


def _at_once(one: Channel, output: Channel) -> tuple[Array, Array, tuple[float, float]]:
    """Both channels at the output's times within the other channel's range, and their rounding steps."""
    told, there = np.isfinite(one.value), np.isfinite(output.value)
    steps = smallest_step(one.value), smallest_step(output.value)
    if not told.any():
        return np.empty(0), np.empty(0), steps
    time, value = one.time[told], one.value[told]
    both = there & (output.time >= time[0]) & (output.time <= time[-1])
    return np.interp(output.time[both], time, value), output.value[both], steps


def _correlation(first: Array, second: Array) -> float:
    if np.ptp(first) == 0.0 or np.ptp(second) == 0.0:
        return 0.0
    return float(np.corrcoef(first, second)[0, 1])
