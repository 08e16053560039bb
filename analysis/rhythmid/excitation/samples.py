"""A command read from a file: what the designer wrote, or any other sequence of samples."""

from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Array, Excitation


@lru_cache(maxsize=8)
def _table(file: str) -> tuple[Array, Array]:
    try:
        table = np.genfromtxt(file, delimiter=",", comments="#", invalid_raise=False)
    except OSError as error:
        raise InputError(f"{file}: the excitation cannot be read: {error}") from None
    table = np.atleast_2d(table)
    if table.shape[1] < 2:
        raise InputError(f"{file}: two columns are expected: time [s], force [N]")
    table = table[1:] if np.isnan(table[0]).any() else table  # a header line
    if len(table) == 0 or not np.isfinite(table[:, :2]).all():
        raise InputError(f"{file}: holds a value that is not a finite number")
    if np.any(np.diff(table[:, 0]) <= 0):
        raise InputError(f"{file}: the times must increase")
    return table[:, 0], table[:, 1]


class Samples(Excitation):
    """u(t) from a CSV file with columns time [s] and force [N]; each value holds until the next."""

    type: Literal["samples"] = "samples"
    file: Path
    scale: float = 1.0

    @property
    def duration(self) -> float:
        times, _ = _table(str(self.file))
        return float(times[-1] + (times[-1] - times[-2] if len(times) > 1 else 0.0))

    def shape(self, time: Array) -> Array:
        times, values = _table(str(self.file))
        index = np.searchsorted(times, time + 1e-9, side="right") - 1
        return np.where(index >= 0, self.scale * values[np.maximum(index, 0)], 0.0)
