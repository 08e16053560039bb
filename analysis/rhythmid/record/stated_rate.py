"""The rate of a table without a time column, or whose time counts its rows, from a single number in it: a simulation's
`dt`, a recorder's `fs`."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.heading import heading_of
from rhythmid.record.signals import Clock
from rhythmid.record.table import Table
from rhythmid.record.table_clock import has_time

STEP = re.compile(
    r"(?:.*[._])?(?:d_?t|t_?s|time_?step|sample_?time|sampl(?:e|ing)_?(?:period|interval))", re.IGNORECASE
)
RATE = re.compile(
    r"(?:.*[._])?(?:f_?s|fps|rate|sampl(?:e|ing)_?(?:rate|frequency)|frame_?rate)", re.IGNORECASE
)


def stated_rate(table: Table, columns: Sequence[tuple[str, NDArray[np.float64]]]) -> tuple[float, str] | None:
    """The rate of the rows [Hz] with the reason; None where a column is the time, or no single number is named as a
    step or a rate."""
    if has_time(columns) or (told := _told(table)) is None:
        return None
    name, value, rate = told
    return rate, f"no column is a time, and {name} is {value:g}"


def clock_of_counter(
    table: Table, columns: Sequence[tuple[str, NDArray[np.float64]]], clock: Clock, reason: str
) -> tuple[Clock, str]:
    """The clock from a column that counts the rows, by the step or the rate that the table states; else the clock as
    it is, with its reason."""
    if clock.kind != "column" or heading_of(str(clock.column)).unit or (told := _told(table)) is None:
        return clock, reason
    if not bool((np.diff(dict(columns)[str(clock.column)]) == 1.0).all()):
        return clock, reason
    name, value, rate = told
    return replace(clock, scale=1.0 / rate), f"it counts the rows, and {name} is {value:g}"


def _told(table: Table) -> tuple[str, float, float] | None:
    """Name and value of the single number that is named as a step or a rate, and the rate [Hz]."""
    for name, values in table.columns.items():
        array = np.asarray(values)
        if array.size != 1 or array.dtype.kind not in "fiu" or not float(array.reshape(-1)[0]) > 0.0:
            continue
        value, heading = float(array.reshape(-1)[0]), heading_of(name)
        for pattern, step in ((STEP, True), (RATE, False)):
            if pattern.fullmatch(name) or pattern.fullmatch(heading.name):
                return name, value, 1.0 / (value * heading.scale) if step else value
    return None
