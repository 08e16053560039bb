"""Timestamps in two columns, whole seconds and nanoseconds, as in tables of ROS messages, joined into one."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

SECONDS = re.compile(r"(.*?)[._ ]?(?:secs?|seconds)", re.IGNORECASE)
NANOSECONDS = re.compile(r"(.*?)[._ ]?(?:nsecs?|nanosecs?|nanoseconds)", re.IGNORECASE)
BILLION = 1e9  # nanoseconds in a second


def stamp_pairs(columns: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """The columns of seconds and nanoseconds of each stamp, by its name: `header.stamp` for `header.stamp.sec`."""
    nanoseconds = {match[1]: name for name in columns if (match := NANOSECONDS.fullmatch(name))}
    found: dict[str, tuple[str, str]] = {}
    for name in columns:
        match = SECONDS.fullmatch(name)
        if match and match[1] in nanoseconds and _go_together(columns[name], columns[nanoseconds[match[1]]]):
            found[match[1] or "stamp"] = (name, nanoseconds[match[1]])
    return found


def _go_together(whole: Any, rest: Any) -> bool:
    """Whether one column holds whole numbers and the other nanoseconds below a second."""
    first, second = np.asarray(whole), np.asarray(rest)
    if (
        first.dtype.kind not in "fiu"
        or second.dtype.kind not in "fiu"
        or first.shape != second.shape
        or first.ndim != 1
    ):
        return False
    if not len(first):
        return False
    return bool(np.all(first == np.rint(first)) and np.all((second >= 0) & (second < BILLION)))


def with_joined_stamps(columns: dict[str, Any]) -> dict[str, Any]:
    """The columns, followed by each stamp [s] that two of them form, unless a column already has that name."""
    joined = {
        stamp: np.asarray(columns[whole], dtype=float) + np.asarray(columns[rest], dtype=float) / BILLION
        for stamp, (whole, rest) in stamp_pairs(columns).items()
        if stamp not in columns
    }
    return columns | joined
