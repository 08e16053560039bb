"""Rows at the beginning of a table that are left from before its clock was set to zero: what stood in a buffer as the recording began."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST = 10  # rows that a buffer holds; where more come before, they are a recording of their own


def stale_rows(time: Array) -> int:
    """Number of the first rows whose times (n,) lie beyond the next one's, where all times after them go forward; 0 where none do."""
    back = np.flatnonzero(np.diff(time) < 0.0)
    if len(back) != 1 or back[0] >= MOST or back[0] + 2 >= len(time):
        return 0
    return int(back[0]) + 1


def without_stale_rows(time: Array, value: Array, file: str) -> tuple[Array, Array, dict[str, None]]:
    """Times and values (n,) without such rows of a file, and what to tell of them, as the keys of a dict."""
    count = stale_rows(time)
    if not count:
        return time, value, {}
    which, kept = ("row 1 has", "it is") if count == 1 else (f"rows 1 to {count} have", "they are")
    said = (
        f"{file}: {which} a time from before the clock began ({time[count - 1]:g} s, then {time[count]:g} s in row {count + 1}): "
        f"{kept} left out"
    )
    return time[count:], value[count:], {said: None}
