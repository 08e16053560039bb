"""Unwrapping of an angle that is read within a turn, or half a turn, and jumps between the ends of that range.

The step across a gap of a record shows no jump, because the motion in a gap may be any. Beyond a gap the angle goes on in the nearest turn.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import gaps_between

Array = NDArray[np.float64]
TURNS = {"2π": 2.0 * math.pi, "π": math.pi}  # [rad]; half a turn is the range of an arc tangent of a ratio
NO_GAPS: NDArray[np.int64] = np.empty(0, dtype=np.int64)


def unwrapped(record: Record) -> Record:
    """The record with an unwrapped output; references that jump in the same way are unwrapped, too."""
    turn = turn_of(record)
    if turn == 0.0:
        return record
    output = _unwrapped(record.output, turn)
    found = replace(record, output=output)
    reference = record.input if record.input_kind == "reference" else record.reference
    if reference is None or reference.unit != record.output.unit or not len(_wraps_in(reference, turn)):
        return found
    asked = _unwrapped(reference, turn)
    # move the reference to the turn in which the machine is
    apart = float(np.median(np.interp(asked.time, output.time, output.value) - asked.value))
    asked = replace(asked, value=asked.value + turn * np.rint(apart / turn))
    return replace(found, **{"input" if record.input_kind == "reference" else "reference": asked})


def _unwrapped(channel: Channel, turn: float) -> Channel:
    return replace(channel, value=np.unwrap(channel.value, period=turn))


def wrap_notes(record: Record) -> tuple[str, ...]:
    """A line on an output that jumps by a turn or half a turn; empty where it does not."""
    said = wraps_of(record)
    return () if said is None else (f"output: {said}",)


def wraps_of(record: Record) -> str | None:
    """The size of the jumps of an output that is read within a turn or half a turn, in one sentence; None where it
    does not jump."""
    turn = turn_of(record)
    if turn == 0.0:
        return None
    name = next(name for name, one in TURNS.items() if one == turn)
    at = _wraps_in(record.output, turn)
    return (
        f"it jumps by {name} rad {len(at)} times, the first at t = {record.output.time[at[0] + 1]:.6g} s, as an angle does that is "
        "read within a turn: it is unwrapped"
    )


def turn_of(record: Record) -> float:
    """The turn [rad] by which an output that is read within one jumps; 0 where it does not."""
    if record.output_kind != "position" or record.output.unit != "rad":
        return 0.0
    return next((turn for turn in TURNS.values() if len(_wraps_in(record.output, turn))), 0.0)


def _wraps_in(channel: Channel, turn: float) -> NDArray[np.intp]:
    """Indices (m,) of the steps of a channel that are jumps by a turn."""
    if not (np.abs(np.diff(channel.value)) > 0.5 * turn).any():
        return np.empty(0, dtype=np.intp)
    return wraps_by(channel.value, turn, gaps_between(channel.time)[0])


def wraps_by(value: Array, turn: float, gaps: NDArray[np.int64] = NO_GAPS) -> NDArray[np.intp]:
    """Indices (m,) of the steps of the values (n,) that are jumps by a turn; empty where any jump is something else.

    A jump is a turn minus the motion during the step. That motion is no larger than in other steps, and it goes in
    the direction opposite to the jump. Steps across `gaps`, the indices (g,) of the samples before them, are left out.
    """
    # repeated values between readings are no motion
    places = np.setdiff1d(np.flatnonzero(np.diff(value)), gaps)
    step = np.diff(value)[places]
    jump = np.abs(step) > 0.5 * turn
    if not jump.any() or jump.all():
        return np.empty(0, dtype=np.intp)
    largest = float(np.abs(step[~jump]).max())
    sized = np.abs(np.abs(step[jump]) - turn).max() <= largest and np.ptp(value) <= turn + largest
    at = np.flatnonzero(jump)
    beside, of = np.concatenate([at - 1, at + 1]), np.concatenate([at, at])
    there = (beside >= 0) & (beside < len(step))
    beside, of = beside[there], of[there]
    against = not jump[beside].any() and bool((step[beside] * step[of] < 0.0).all())
    return places[at] if sized and against else np.empty(0, dtype=np.intp)
