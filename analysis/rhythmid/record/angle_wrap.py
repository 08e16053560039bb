"""An angle that is read within one turn, or half of one, and jumps from one end to the other where it passes the end."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.record import Record

Array = NDArray[np.float64]
TURNS = {"2π": 2.0 * math.pi, "π": math.pi}  # rad: half a turn is what an arc tangent of a ratio tells


def wrap_notes(record: Record) -> tuple[str, ...]:
    """A line on an output that jumps by a turn or half of one; none where it does not."""
    said = wraps_of(record)
    return () if said is None else (f"output: {said}",)


def wraps_of(record: Record) -> str | None:
    """By what an output jumps that is read within a turn or half of one, and what to do, in one sentence; None where it does not."""
    if record.output_kind != "position" or record.output.unit != "rad":
        return None
    value = record.output.value
    found = next(((name, at) for name, turn in TURNS.items() if len(at := _wraps(value, turn))), None)
    if found is None:
        return None
    name, at = found
    return (
        f"it jumps by {name} rad {len(at)} times, the first at t = {record.output.time[at[0] + 1]:.6g} s, as an angle does that is "
        "read within a turn: a model takes that for a motion; unwrap it (numpy.unwrap, MATLAB's unwrap), or  use:  a part without a jump"
    )


@contextmanager
def told_of_wraps(records: Sequence[Record]) -> Iterator[None]:
    """Errors of a fit to these records say, too, what may be their cause, where an output jumps by a turn."""
    try:
        yield
    except InputError as error:
        found = next((f"{one.name}: {note}" for one in records for note in wrap_notes(one)), None)
        if found is None:
            raise
        raise InputError(f"{error}. {found}") from error


def _wraps(value: Array, turn: float) -> NDArray[np.intp]:
    """Steps (m,) of the values (n,) that are jumps by a turn; none where any jump is something else.

    A jump is a turn less what the angle moves meanwhile, which is no more than in any other step, and the angle moves on against it.
    """
    places = np.flatnonzero(np.diff(value))  # where it is held between its readings it does not move
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
