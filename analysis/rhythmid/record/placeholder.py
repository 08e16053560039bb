"""Placeholders: numbers that a logger writes where it has no measurement, such as -1e6, 9999 or 65535.

Nothing marks them but their size and their repetition. A machine's quantity passes through the values between two of
its samples, and noise makes no two large values equal. So a value that is repeated exactly, beyond all other values
by many times their whole range and without one sample on the way, is no measurement.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FEWEST = 2  # samples with a number that loggers write for "nothing": a single one may be an outlier
# samples with any other number: rows that repeat a sample hold an outlier as often as they repeat it
FEWEST_OF_ANY = 10
# least number of other values: a command switches between few levels, of which one may be far from the others
LEVELS = 5
# least distance to the nearest other value, in ranges of all other values, of a number that loggers write for
# "nothing". A pulse of ten times the range of all else is possible, one of exactly such a number is hardly.
FAR_CODE = 10.0
FAR = 1000.0  # the same for any other number, such as -1e6 in another unit: no sensor resolves such a pulse and the rest
FEWEST_NINES = 999.0  # the smallest such number of nines
FEWEST_ZEROS = 1e4  # the smallest such power of ten: 1000 may well be a command
LEAST_BITS = 15  # of the largest and smallest integers of a word that stand for "nothing"
MOST_BITS = 64

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Placeholder:
    """The numbers that stand for no measurement in one channel, and where they do, bool[n]."""

    values: tuple[float, ...]
    where: Mask

    @property
    def count(self) -> int:
        """Number of samples that hold one."""
        return int(self.where.sum())

    @property
    def words(self) -> str:
        """The numbers, as recorded."""
        return " or ".join(f"{value:.12g}" for value in self.values)


def placeholder_of(value: NDArray[np.float64]) -> Placeholder | None:
    """The placeholders among the recorded values (n,), before any scaling; None where there are none."""
    where, values = np.zeros(len(value), dtype=bool), list[float]()
    while (found := _extreme(value[~where])) is not None:
        where |= value == found
        values.append(found)
    return Placeholder(tuple(values), where) if values else None


def without_placeholders(columns: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Placeholder]]:
    """Columns of a table, vectors (n,) or arrays (n, k), with NaN for placeholders; and what was found, by column.

    The placeholders of one column are those of another that holds the same number in the same rows, even where that
    one is constant otherwise.
    """
    vectors = {
        part: values for name, array in columns.items() for part, values in _vectors(name, array).items()
    }
    found = {part: one for part, values in vectors.items() if (one := placeholder_of(values)) is not None}
    if not found:
        return dict(columns), {}
    known = list(found.values())
    for part, values in vectors.items():
        alike = (one for one in known if len(one.values) == 1 and len(one.where) == len(values))
        same = next((one for one in alike if np.array_equal(values == one.values[0], one.where)), None)
        if part not in found and same is not None:
            found[part] = same
    return {name: _without(name, array, found) for name, array in columns.items()}, found


def _without(name: str, array: Any, found: Mapping[str, Placeholder]) -> Any:
    own = {part: found[part] for part in _vectors(name, array) if part in found}
    if not own:
        return array
    made = np.array(array, dtype=np.float64)
    if name in own:
        made.reshape(-1)[own[name].where] = np.nan
        return made
    for part, one in own.items():
        made[one.where, int(part[len(name) + 1 : -1])] = np.nan
    return made


def _vectors(name: str, array: Any) -> dict[str, NDArray[np.float64]]:
    """The columns of an array by name, `name[1]` where it has several; empty where it holds no numbers."""
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu" or array.size < 2:
        return {}
    if array.size == max(array.shape):
        return {name: array.reshape(-1).astype(np.float64)}
    if array.ndim != 2 or array.shape[1] > array.shape[0]:
        return {}
    return {f"{name}[{number}]": column.astype(np.float64) for number, column in enumerate(array.T)}


@np.errstate(over="ignore", invalid="ignore")  # for numbers near the largest
def _extreme(value: NDArray[np.float64]) -> float | None:
    """The largest or smallest value where it is a placeholder."""
    told = value[np.isfinite(value)]
    if len(told) <= FEWEST:
        return None
    for extreme in (float(told.max()), float(told.min())):
        others = told[told != extreme]
        fewest, far = (FEWEST, FAR_CODE) if is_code(extreme) else (FEWEST_OF_ANY, FAR)
        if not fewest <= len(told) - len(others) < len(told):
            continue
        span = float(np.ptp(others))
        near = float(np.abs(others - extreme).min())
        if span > 0.0 and near > far * span and len(np.unique(others)) >= LEVELS:
            return extreme
    return None


def is_code(value: float) -> bool:
    """Whether a number is one that loggers write for "nothing": nines, a power of ten, or an end of a word's range."""
    size = abs(value)
    if not FEWEST_NINES <= size < np.inf or size != np.floor(size):
        return False
    if size == float(np.finfo(np.float32).max) or size == np.finfo(np.float64).max:
        return True
    exponent = round(float(np.log10(size)))
    nines, power = size == 10.0**exponent - 1.0, size == 10.0**exponent and size >= FEWEST_ZEROS
    bits = round(float(np.log2(size)))
    ends = LEAST_BITS <= bits <= MOST_BITS and size in (2.0**bits, 2.0**bits - 1.0)
    return nines or power or ends
