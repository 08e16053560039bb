"""Two clocks in one table that disagree: a counted time with a fixed step per row, and a measured time."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.signals import Clock, Signals
from rhythmid.record.table import Table, is_table
from rhythmid.record.table_clock import is_further_time, named_clock

Array = NDArray[np.float64]
# largest skew of clocks of one computer: quartz clocks differ by 1e-4, clocks set by a network by somewhat more
SKEW = 1e-3
COUNTED = 1e-6  # relative difference of steps of a counted time beyond the rounding of its numbers
ROUNDING = 4.0  # units in the last place of the largest time by which a difference of two may be off
OF_WORK = re.compile(
    r"(?:^|_)(?:cpu|process|user|sys)(?:_|$)", re.IGNORECASE
)  # of a computer: no time of the rows
SIMULATED = re.compile(
    r"(?:^|_)sim", re.IGNORECASE
)  # a counted time that is the motion's own, however long the run took
STEPS = 2.0  # longest steps of either clock by which their spans may differ at their ends


def is_counted(time: Array) -> bool:
    """Whether all steps of a time are equal, as for counted rows."""
    step = np.diff(time)
    usual = float(np.median(step))
    rounding = ROUNDING * float(np.spacing(np.abs(time).max()))
    return bool(np.abs(step - usual).max() <= COUNTED * usual + rounding)


def disagreeing(columns: Sequence[tuple[str, Array]], name: str, time: Array) -> list[tuple[str, Array]]:
    """Other columns that are named as times but give another duration of these rows, with their times [s]."""
    found: list[tuple[str, Array]] = []
    for other, value in columns:
        if (
            other == name
            or len(value) != len(time)
            or not is_further_time(other, value)
            or OF_WORK.search(other)
        ):
            continue
        told = value * named_clock(other, value)[0].scale
        first, second = float(time[-1] - time[0]), float(told[-1] - told[0])
        ends = STEPS * float(max(np.diff(time).max(), np.diff(told).max()))
        if abs(first - second) > SKEW * max(first, second) + ends:
            found.append((other, told))
    return found


def trusted_clock(columns: Sequence[tuple[str, Array]], clock: Clock, reason: str) -> tuple[Clock, str]:
    """The chosen clock with the reason, or a measured one where the chosen one is counted and they disagree."""
    name, values = str(clock.column), dict(columns)
    time = values[name] * clock.scale
    if not is_counted(time) or SIMULATED.search(name):
        return clock, reason
    for other, told in disagreeing(columns, name, time):
        if not is_counted(told):
            taken, why = named_clock(other, values[other])
            return taken, f"{why}; it was read from a clock, and {name} counts the rows by a fixed step"
    return clock, reason


def clock_notes(columns: Sequence[tuple[str, Array]], name: str, time: Array) -> tuple[str, ...]:
    """A line on every clock that disagrees with the chosen one, with the likely reason."""
    counted = is_counted(time)
    return tuple(
        f"the table has two clocks that disagree: {name}, which is taken, has {1e3 * _step(time):.4g} ms a row, {other} "
        f"{1e3 * _step(told):.4g} ms; {_why(counted, is_counted(told))}; for the other one:  time: {{column: {other!r}}}"
        for other, told in disagreeing(columns, name, time)
    )


def _step(time: Array) -> float:
    return float(time[-1] - time[0]) / (len(time) - 1)


def _why(counted: bool, other_counted: bool) -> str:
    if counted and not other_counted:
        return "the one that is taken counts rows by a fixed step, the other one was read from a clock and is to be trusted more"
    if other_counted and not counted:
        return "the other one counts rows by a fixed step, the one that is taken was read from a clock"
    return "nothing tells which of them is right"


def read_clock_notes(source: Path, signals: Signals) -> list[str]:
    """Clock notes for the tables that a signals.yaml names, or for the table `source` whose columns it names."""
    name = signals.time.column
    if signals.time.kind != "column":
        return []
    files = {channel.file or source for channel in signals.channels.values()}
    found: list[str] = []
    for file in sorted(one for one in files if is_table(one)):
        table = Table.load(file)
        try:
            chosen = table.column(name)
        except InputError:  # the channels of this file have their own time
            continue
        if len(chosen) > 1 and np.isfinite(chosen).all():
            found += clock_notes(list(table.vectors()), str(name), chosen * signals.time.scale)
    return found
