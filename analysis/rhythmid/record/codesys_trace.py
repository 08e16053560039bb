"""Traces exported as text by the CODESYS editor: keys with values, and below `0.Data`, `1.Data` … the times and
values of each variable, one after the other."""

import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.text_cells import number_of

VARIABLE = re.compile(r"\d+\.Variable;\s*(\S.*?)\s*")
SAMPLE = ";"  # separator in a line with a time and a value
TIME = "time"


def is_trace(lines: Iterable[str]) -> bool:
    """Whether a file that begins with these lines is a CODESYS trace."""
    return any(VARIABLE.fullmatch(line.rstrip("\r\n")) for line in lines)


def read_trace(lines: Iterable[str]) -> dict[str, NDArray[np.float64]]:
    """The times of all samples, in order, and the variables by name; float64[n] each, NaN where a variable has no sample.

    Raises ValueError where a line with samples is damaged.
    """
    found: dict[str, dict[float, float]] = {}
    samples: dict[float, float] = {}
    for number, line in enumerate(lines, start=1):
        if named := VARIABLE.fullmatch(line.rstrip("\r\n")):
            samples = found.setdefault(named[1], {})
        elif line.startswith(SAMPLE):
            time, value = _sample(line[1:].split(";"), number)
            samples[time] = value
    times = sorted({time for each in found.values() for time in each})
    columns = {name: np.array([each.get(time, np.nan) for time in times]) for name, each in found.items()}
    return {TIME: np.array(times), **columns}


def _sample(cells: Sequence[str], number: int) -> tuple[float, float]:
    told = [number_of(cell, "." if "." in cell else ",") for cell in cells]
    if len(told) != 2 or told[0] is None or told[1] is None or not np.isfinite(told[0]):
        raise ValueError(f"line {number} of the trace holds no time and value")
    return told[0], told[1]
