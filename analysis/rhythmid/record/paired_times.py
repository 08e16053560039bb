"""Columns in pairs, each value behind its own time, as programs export the curves of a plot: `/q_x` and `/q_y` of rqt_plot,
`Time - Plot 0` and `Amplitude - Plot 0` of LabVIEW."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.stream import Stream, on_all_times
from rhythmid.record.table_clock import is_even

PAIRS = (
    (re.compile(r"(.+)_x"), re.compile(r"(.+)_y")),
    (re.compile(r"Time - (.+)"), re.compile(r"Amplitude - (.+)")),
)
TIME = "time"


def with_common_time(columns: Mapping[str, Any]) -> dict[str, Any]:
    """The columns, if all of them are pairs of a time and a value, on the times of all and NaN between; else as given."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    if (
        not arrays
        or len(arrays) % 2
        or any(one.ndim != 1 or one.dtype.kind not in "fiu" for one in arrays.values())
    ):
        return dict(columns)
    names = list(arrays)
    streams = [_stream(time, value, arrays) for time, value in zip(names[::2], names[1::2])]
    found = [one for one in streams if one is not None]
    return on_all_times(found, TIME) if len(found) == len(streams) else dict(columns)


def _stream(time: str, value: str, arrays: Mapping[str, NDArray[Any]]) -> Stream | None:
    """The stream of two columns, None where they are not a time and its value."""
    for pattern, of_value in PAIRS:
        first, second = pattern.fullmatch(time), of_value.fullmatch(value)
        if first is None or second is None or first[1] != second[1]:
            continue
        when, what = arrays[time].astype(np.float64), arrays[value].astype(np.float64)
        there = np.isfinite(when)
        return Stream(when[there], {first[1]: what[there]}) if is_even(when[there]) else None
    return None
