"""Rests at the ends of a record that the machine's model cannot explain: an output that stops although the drive
continues, and an output that is held, or not yet pushed, at the start of a free motion."""

import math

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.free_motion import freed
from rhythmid.record.record import Record

Array = NDArray[np.float64]
# least length of a rest at an end, as a share of the record: a shorter one hardly changes the fit
LEAST_SHARE = 0.05
WINDOWS = 3  # stretches before a rest in all of which the machine must move
# ratio to the usual travel of a drive above which the drive continues as before: steps of equal size have 1
AS_MUCH = 0.9


def rest_notes(record: Record) -> tuple[str, ...]:
    """A line on each rest at the start or end of an output that the machine does not cause."""
    return tuple(f"output: {said}" for said in rests_of(record))


def rests_of(record: Record) -> tuple[str, ...]:
    """Message about such rests, a sentence each."""
    time, free, end = record.output.time, freed(record), stop(record)
    found: list[str] = []
    if free is not None and free.pushed:
        found.append(
            f"it gains speed until t = {_written(free.until)} s at least, though nothing that drives it was recorded: it was pushed, which no model "
            f"of the machine does; begin where it moves freely:  {use_line(record)}"
        )
    elif free is not None and free.until > time[0]:
        found.append(
            f"it rests for the first {free.until - time[0]:.3g} s and then moves, though nothing that drives it was recorded: it was held or "
            f"pushed, which no model of the machine does; begin where it moves freely:  {use_line(record)}"
        )
    if free is not None and free.end is not None:
        found.append(
            f"it gains speed again after t = {_written(free.end)} s, though nothing that drives it was recorded: it was pushed; end before that:  "
            f"{use_line(record)}"
        )
    if end is not None:
        found.append(
            f"it stands still from t = {_written(end)} s to the end ({time[-1] - end:.3g} s), although what drives it changes as much as where it "
            "moved before: its sensor or its drive failed, or it sticks, which is physics and is kept; where something failed, say  "
            f"{use_line(record)}"
        )
    return tuple(found)


def use_line(record: Record) -> str | None:
    """The line of signals.yaml that excludes such rests, on the clock of `use:`; None where there are none."""
    time, free, end = record.output.time, freed(record), stop(record)
    if free is None and end is None:
        return None
    first = math.floor(time[0]) if free is None else free.begin
    if free is not None and free.end is not None:
        end = free.end
    last = math.ceil(time[-1]) if end is None else end
    return f"use: [{_written(first + record.use_zero)}, {_written(last + record.use_zero)}]"


def stop(record: Record) -> float | None:
    """Time [s] at which an output stops for good while the drive continues as before; None where none does."""
    drive = record.input or record.effort or record.reference
    value, time = record.output.value, record.output.time
    moves = np.flatnonzero(np.diff(value))
    if drive is None or not len(moves):
        return None
    last = int(moves[-1]) + 1
    length = min(len(value) - last, last // WINDOWS)
    if length < LEAST_SHARE * len(value):
        return None
    before = [(begin, begin + length) for begin in range(last - length, -1, -length)]
    after = [(begin, begin + length) for begin in range(last, len(value) - length + 1, length)]
    if any(np.ptp(value[begin:end]) == 0.0 for begin, end in before):
        return None
    given = np.interp(time, drive.time, drive.value)
    # the integral is checked, too: a fast drive moves a machine less than a slow one of equal size
    for travel in (lambda part: float(np.ptp(given[part])), lambda part: _integral(time[part], given[part])):
        usual, now = (float(np.median([travel(slice(*one)) for one in part])) for part in (before, after))
        if now == 0.0 or now < AS_MUCH * usual:
            return None
    return float(time[last])


def _integral(time: Array, given: Array) -> float:
    """Travel of the integral of a drive (n,) relative to its mean."""
    beside = given - given.mean()
    return float(np.ptp(np.cumsum(0.5 * (beside[1:] + beside[:-1]) * np.diff(time))))


def _written(time: float) -> str:
    """A time [s] written to the millisecond, whatever its size."""
    return f"{round(time, 3):.12g}"
