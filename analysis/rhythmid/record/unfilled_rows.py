"""Rows of zeros at the end of a table: the part of a preallocated buffer that a recording did not fill."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.table_clock import is_called_time, is_time


def without_unfilled_rows(columns: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The columns without such rows, and a message about them; the columns as they are where a time goes forward to its
    end, or any number of the rows after it is not zero."""
    vectors = {name: _vector(one) for name, one in columns.items() if is_called_time(name)}
    times = {name: one for name, one in vectors.items() if one is not None}
    if any(is_time(name, time) for name, time in times.items()):
        return dict(columns), ()
    for name, time in times.items():
        filled = int(np.max(np.flatnonzero(time), initial=-1)) + 1
        if not 0 < filled < len(time) or not is_time(name, time[:filled]):
            continue
        rows = {key: one for key, one in columns.items() if _has_rows(one, len(time))}
        if any(np.any(np.asarray(one)[filled:]) for one in rows.values()):
            continue
        kept = {key: np.asarray(one)[:filled] if key in rows else one for key, one in columns.items()}
        count = len(time) - filled
        which = f"row {filled + 1} holds" if count == 1 else f"rows {filled + 1} to {len(time)} hold"
        told = f"{which} nothing but zeros after the last time ({name}), as the rest of a buffer does, and cannot be used"
        return kept, (told,)
    return dict(columns), ()


def _vector(one: Any) -> NDArray[np.float64] | None:
    """A column as a vector (n,); None where it holds no numbers, or an array."""
    values = np.asarray(one)
    whole = values.size == max(values.shape, default=0)
    return values.reshape(-1).astype(np.float64) if values.dtype.kind in "fiu" and whole else None


def _has_rows(one: Any, count: int) -> bool:
    """Whether it is an array of numbers with that many rows."""
    values = np.asarray(one)
    return values.ndim >= 1 and len(values) == count and values.dtype.kind in "fiub"
