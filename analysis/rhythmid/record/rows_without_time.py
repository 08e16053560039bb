"""Rows of a table whose time is empty, such as a recorder's first row before its clock is read: they cannot be placed, and
are left out."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.table_clock import is_called_time, is_time

MOST = 0.01  # largest share of rows without a time that is left out: more of them are another kind of column


def without_untimed_rows(columns: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The columns without such rows, and a message about them; the columns as they are where a time is complete, or too
    many rows have none."""
    times = {name: one for name, one in columns.items() if is_called_time(name) and _is_vector(one)}
    if any(is_time(name, one) for name, one in times.items()):
        return dict(columns), ()
    for name, time in times.items():
        there = np.isfinite(time)
        if 0.0 < 1.0 - float(there.mean()) <= MOST and is_time(name, time[there]):
            left = np.flatnonzero(~there)
            kept = {
                other: one[there] if isinstance(one, np.ndarray) and len(one) == len(time) else one
                for other, one in columns.items()
            }
            rows = "1 row has" if len(left) == 1 else f"{len(left)} rows have"
            return kept, (f"{rows} no time ({name}) and cannot be used, the first of them row {left[0] + 1}",)
    return dict(columns), ()


def _is_vector(column: NDArray[Any] | Any) -> bool:
    return (
        isinstance(column, np.ndarray) and column.ndim == 1 and column.dtype.kind == "f" and len(column) > 0
    )
