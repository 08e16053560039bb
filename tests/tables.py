"""Tables of numbers as a logger writes them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np


def write_columns(path: Path, columns: Mapping[str, np.ndarray]) -> Path:
    """A CSV file of these columns (n,), with their names in the first line."""
    values = np.column_stack(list(columns.values()))
    np.savetxt(path, values, delimiter=",", header=",".join(columns), comments="")
    return path
