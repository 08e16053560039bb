"""Tables that merge streams with their own timestamps, as PlotJuggler and pandas write them.

A row has the timestamp of one message, and the cells of all other streams are empty. An empty cell is then no lost
sample.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
OFTEN = 0.05  # least share of rows in which each column of a merged table is empty
TOGETHER = 0.5  # largest share of rows with a number in every column, or in a slow column
# longest run of empty rows of a column that is sampled throughout, as a share of all rows
LONGEST_EMPTY_SHARE = 0.05


def is_merged(columns: Iterable[Array]) -> bool:
    """Whether the columns, (n,) each, without the time, come from streams whose rows were merged. Empty columns are
    ignored."""
    present = [there for value in columns if (there := np.isfinite(value)).any()]
    if len(present) < 2 or any(there.all() for there in present) or len({len(one) for one in present}) > 1:
        return False
    together = float(np.logical_and.reduce(present).mean())
    if together == 0.0:  # however few messages one stream has
        return True
    return all(there.mean() <= 1.0 - OFTEN for there in present) and together <= TOGETHER


def is_sampled_rarely(value: Array) -> bool:
    """Whether a column (n,) is empty in most rows, but never for long: a stream that is slower than the table's rows."""
    there = np.flatnonzero(~np.isnan(value))
    if not 0 < len(there) <= TOGETHER * len(value):
        return False
    empty = np.diff(np.concatenate([[-1], there, [len(value)]])) - 1
    return bool(empty.max() <= LONGEST_EMPTY_SHARE * len(value))
