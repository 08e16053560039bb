"""Cells that hold a number with its unit: `0.12 rad`."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.heading import is_unit
from rhythmid.record.text_cells import is_missing, number_of

MEASURED = re.compile(r"([+−-]?[\d.,]+(?:e[+-]?\d+)?)\s*([^\d\s.,+-].*)", re.IGNORECASE)


def is_measured(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number followed by a known unit."""
    return _parts(cell, decimal) is not None


def measured(cells: Sequence[str], decimal: str) -> tuple[NDArray[np.float64], str] | None:
    """Numbers (n,) of cells with one common unit, and the unit; None where the units differ. A cell without a
    number gives NaN."""
    found = [(np.nan, "") if is_missing(cell) else _parts(cell, decimal) for cell in cells]
    units = {one[1] for one in found if one is not None} - {""}
    if None in found or len(units) != 1:
        return None
    return np.array([one[0] for one in found if one is not None]), units.pop()


def _parts(cell: str, decimal: str) -> tuple[float, str] | None:
    match = MEASURED.fullmatch(cell.strip())
    value = None if match is None else number_of(match[1], decimal)
    if match is None or value is None or not is_unit(match[2]):
        return None
    return value, match[2]
