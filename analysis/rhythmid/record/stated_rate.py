"""The rate of a table without a time column, from a single number in it: a simulation's `dt`, a recorder's `fs`."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.heading import heading_of
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
    if has_time(columns):
        return None
    for name, values in table.columns.items():
        array = np.asarray(values)
        if array.size != 1 or array.dtype.kind not in "fiu" or not float(array.reshape(-1)[0]) > 0.0:
            continue
        value, heading = float(array.reshape(-1)[0]), heading_of(name)
        for pattern, step in ((STEP, True), (RATE, False)):
            if pattern.fullmatch(name) or pattern.fullmatch(heading.name):
                rate = 1.0 / (value * heading.scale) if step else value
                return rate, f"no column is a time, and {name} is {value:g}"
    return None
