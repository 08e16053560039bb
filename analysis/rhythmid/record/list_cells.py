"""Cells of a text table that hold lists of numbers, as Python and NumPy print them: [0.1, -0.2], [0.1 -0.2], (0.1, -0.2),
array('d', [0.1, -0.2])."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.text_cells import is_missing, number_of
from rhythmid.record.text_rows import Rows

# brackets around text without brackets, possibly within a call such as array, float32 or tensor
LIST = re.compile(r"(?:[\w.]+\((?:'\w',\s*)?)?[\[(]([^\[\]()]*)[\])](?:,\s*\w+=[\w.]+)?\)?")
BETWEEN = re.compile(r"[,;\s]+")  # separator of the numbers of a list


def list_of(cell: str) -> list[float] | None:
    """The numbers of a list, NaN for a missing one; None where a cell holds no list."""
    if cell[-1:] not in ("]", ")"):
        return None
    found = LIST.fullmatch(cell)
    if found is None or (cell.startswith("(") and not BETWEEN.search(found[1])):  # (3) is no tuple
        return None
    parts = [number_of(part, ".") for part in BETWEEN.split(found[1].strip(" ,;")) if part]
    return None if None in parts else [part for part in parts if part is not None]


def lists_of(cells: Sequence[str], rows: Rows, column: int) -> NDArray[np.float64] | None:
    """The lists of a column, float64[n, k], NaN where a cell is empty; None where the first filled cell holds no list.

    Raises ValueError where another row has another number of values, or no list.
    """
    first = next((found for cell in cells if not is_missing(cell) and (found := list_of(cell)) != []), None)
    if first is None:
        return None
    nothing = [np.nan] * len(first)
    made: list[list[float]] = []
    for place, cell in enumerate(cells):
        found = [] if is_missing(cell) else list_of(cell)
        if found is None:
            raise rows.complaint(place, f"holds no list of numbers in column {column + 1}, as others do")
        if found and len(found) != len(first):
            raise rows.complaint(
                place, f"holds a list of {len(found)} in column {column + 1}, the first holds {len(first)}"
            )
        made.append(found or nothing)
    return np.array(made, dtype=np.float64)
