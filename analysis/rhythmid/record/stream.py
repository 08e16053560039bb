"""Streams of one recording with times of their own, as the columns of one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stream:
    """Times (n,) [s], and columns (n,) by name."""

    time: Array
    columns: Mapping[str, Array]


def on_all_times(streams: Sequence[Stream], time: str) -> dict[str, Any]:
    """A table of all columns by name on the times of all streams, which are its column `time`; a column is NaN where its
    stream has no row."""
    every = np.unique(np.concatenate([one.time for one in streams]))
    columns: dict[str, Any] = {time: every}
    for one in streams:
        places = np.searchsorted(every, one.time)
        for name, values in one.columns.items():
            whole = np.full(len(every), np.nan)
            whole[places] = values
            columns[name] = whole
    return columns
