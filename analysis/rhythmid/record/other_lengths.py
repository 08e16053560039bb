"""Arrays of a file that do not have one value per time: they are left out and reported with the reason."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.grouped_runs import grouped_runs
from rhythmid.record.json_table import JSON
from rhythmid.record.signals import Signals
from rhythmid.record.table import HDF5, WIDEST, Table, table_suffix

OF_ARRAYS = (".mat", ".npz", *HDF5, *JSON)  # kinds of tables whose columns may differ in length
# least number of values of an array that may be a recording rather than parameters
LEAST_VALUES_OF_RECORDING = 40
NAMED = 8  # largest number of arrays that a note names


@dataclass(frozen=True)
class Unequal:
    """An array with its shape, and the reason why it is no column for the times."""

    name: str
    shape: tuple[int, ...]
    why: str

    def __str__(self) -> str:
        return f"{self.name}: {self.why}"


def unequal_arrays(table: Table, rows: int) -> Iterator[Unequal]:
    """Arrays of numbers without exactly one value, or one row of a few values, per time of the `rows` times."""
    for name, values in table.columns.items():
        array = np.asarray(values)
        if array.dtype.kind in "fiubc" and array.size > 1 and (why := _why(array, rows)):
            yield Unequal(name, array.shape, why)


def _why(array: NDArray[Any], rows: int) -> str:
    """Reason why an array is no column for `rows` times; empty where it is one."""
    shape = " x ".join(map(str, array.shape))
    if array.dtype.kind == "c":
        return "holds complex numbers"
    if array.ndim > 2:
        return f"has {array.ndim} dimensions ({shape})"
    if array.size == max(array.shape):
        return "" if array.size == rows else f"has {array.size} values, the time {rows}"
    if array.shape[1] == rows:
        return f"lies across ({shape}): transpose it"
    if array.shape[1] > WIDEST:
        return f"has {array.shape[1]} columns ({shape}); at most {WIDEST} are read"
    return "" if len(array) == rows else f"has {len(array)} rows ({shape}), the time {rows}"


def length_notes(table: Table, rows: int) -> tuple[str, ...]:
    """One line on all such arrays that may be recordings; empty where there are none."""
    found = [str(one) for one in unequal_arrays(table, rows) if max(one.shape) >= LEAST_VALUES_OF_RECORDING]
    if not found:
        return ()
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    listed = "; ".join(found[:NAMED])
    return (
        f"left out, because they do not go with the time: {listed}{more}; a channel may have a time: of its own",
    )


def read_length_notes(source: Path, signals: Signals) -> list[str]:
    """Length notes for the tables that a signals.yaml names, or for the table `source` whose columns it names."""
    files = {channel.file or source for channel in signals.channels.values()}
    found: list[str] = []
    for file in sorted(one for one in files if table_suffix(one) in OF_ARRAYS):
        table = Table.load(file)
        output = signals.channels["output"].column
        runs = grouped_runs(table)
        try:
            rows = len(table.column(output))
        except InputError:  # the output is in another file
            continue
        alone = table if runs is None else runs.alone(table, str(output))
        found += length_notes(alone, rows)
    return found
