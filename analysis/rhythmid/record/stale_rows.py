"""Rows at the start of a table from before its clock was set to zero: the content of a buffer when the recording began."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LONGEST_BUFFER = 10  # rows; more rows are a recording of their own


def stale_rows(time: Array) -> int:
    """Number of first rows before the only step back of the times (n,); 0 if there is no such step, or if it comes later."""
    back = np.flatnonzero(np.diff(time) < 0.0)
    if len(back) != 1 or back[0] >= LONGEST_BUFFER or back[0] + 2 >= len(time):
        return 0
    return int(back[0]) + 1


def without_stale_rows(time: Array, value: Array, file: str) -> tuple[Array, Array, dict[str, None]]:
    """Times and values (n,) without such rows of a file, and the notes on them as keys of a dict."""
    count = stale_rows(time)
    if not count:
        return time, value, {}
    which, kept = ("row 1 has", "it is") if count == 1 else (f"rows 1 to {count} have", "they are")
    said = (
        f"{file}: {which} a time from before the clock began ({time[count - 1]:g} s, then {time[count]:g} s in row {count + 1}): "
        f"{kept} left out"
    )
    return time[count:], value[count:], {said: None}
