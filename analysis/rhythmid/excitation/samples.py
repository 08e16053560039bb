"""A command read from a file: the designer's samples or any others."""

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, ValidationInfo

from rhythmid.excitation.excitation import Array, Excitation
from rhythmid.time_table import read_time_table

IN_FOLDER = "folder"  # key in the validation context


@lru_cache(maxsize=8)
def _table(file: str) -> tuple[Array, Array]:
    return read_time_table(file, "force [N]")


def _resolved(file: Path, info: ValidationInfo) -> Path:
    """Path of a file; a name in a description is relative to the file that contains the description."""
    return (info.context or {}).get(IN_FOLDER, Path()) / file


class Samples(Excitation):
    """u(t) from a CSV file with columns time [s] and force [N]; each value holds until the next."""

    type: Literal["samples"] = "samples"
    file: Annotated[Path, AfterValidator(_resolved)]
    scale: float = 1.0

    @property
    def duration(self) -> float:
        times, _ = _table(str(self.file))
        return float(times[-1] + (times[-1] - times[-2] if len(times) > 1 else 0.0))

    def shape(self, time: Array) -> Array:
        times, values = _table(str(self.file))
        index = np.searchsorted(times, time + 1e-9, side="right") - 1
        return np.where(index >= 0, self.scale * values[np.maximum(index, 0)], 0.0)
