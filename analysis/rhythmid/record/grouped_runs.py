"""Several runs in one file, each in its own struct or group: `runs[0].q` and `runs[1].q`, `trial1.q` and `trial2.q`; or each an
array of its own with the time in its first column, as in the JSON files of WPILib's SysId (docs.wpilib.org)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from rhythmid.record.table import WIDEST, Table
from rhythmid.record.table_clock import is_even

NUMBERED = re.compile(r"(.*?)(\[\d+\]|\d+)")  # a numbered struct or group
OF_RUNS = re.compile(
    r"(?:.*[._ ])?(?:episodes?|trials?|runs?|trajector(?:y|ies)|segments?|tests?|exp|experiments?|rec|recordings?|records?|logs?"
    r"|measurements?|sessions?|takes?|sweeps?)[._ ]?",
    re.IGNORECASE,
)
TIME = re.compile(r"(?:.*[._ ])?(?:time|timestamp|stamp|t)(?:[._ ]?(?:s|ms|us|ns))?", re.IGNORECASE)


@dataclass(frozen=True)
class Runs:
    """Runs by path, such as `runs[0]`, in the order of the file; the arrays of each by their names within the run."""

    members: Mapping[str, Mapping[str, Any]]

    @property
    def note(self) -> str:
        """The number of runs, as a phrase."""
        first, *_, last = self.members
        return f"{len(self.members)} runs, {first} to {last}"

    def alone(self, table: Table, column: str | None = None) -> Table:
        """The table with only the arrays of the run that holds `column`, by default the first run."""
        paths = list(self.members)
        own = next((path for path in paths if column is not None and _is_in(column, path)), paths[0])
        others = [path for path in paths if path != own]
        kept = {
            name: values
            for name, values in table.columns.items()
            if not any(_is_in(name, path) for path in others)
        }
        return Table(table.path, kept)

    def numbered(self) -> dict[str, Mapping[str, Any]]:
        """The arrays of each run by its number, or by its name where it has none."""
        return {(re.findall(r"\d+", path) or [path])[-1]: arrays for path, arrays in self.members.items()}


def _is_in(name: str, path: str) -> bool:
    """Whether a column is in the struct with this path, or of the array with this name."""
    return name == path or name.startswith((f"{path}.", f"{path}["))


def grouped_runs(table: Table) -> Runs | None:
    """The runs that a table holds side by side, each with its own time; None where there are fewer than two.

    Structs and groups with identical times were recorded together, such as the joints of a robot, unless their name
    says that they are runs.
    """
    families: dict[str, dict[str, dict[str, Any]]] = {}
    for name, values in table.columns.items():
        for stem, path, field in _places(name):
            families.setdefault(stem, {}).setdefault(path, {})[field] = values
    for stem, members in families.items():
        timed = {path: arrays for path, arrays in members.items() if _time_of(arrays) is not None}
        if len(timed) > 1 and (OF_RUNS.fullmatch(stem) or not _at_once(timed)):
            return Runs(timed)
    return _runs_in_arrays(table)


def _runs_in_arrays(table: Table) -> Runs | None:
    """The runs of which each is an array: all arrays of the same few columns, of different lengths, whose first column goes
    forward as a time does; None where there are fewer than two, or other arrays beside them."""
    arrays = {name: np.asarray(values) for name, values in table.columns.items()}
    numbers = {name: one for name, one in arrays.items() if one.dtype.kind in "fiu" and one.size > 1}
    if len(numbers) < 2 or any(one.ndim != 2 for one in numbers.values()):
        return None
    widths = {one.shape[1] for one in numbers.values()}
    lengths = {len(one) for one in numbers.values()}
    told = len(widths) == 1 and 1 < min(widths) <= WIDEST and len(lengths) > 1
    if not told or not all(is_even(one[:, 0].astype(float)) for one in numbers.values()):
        return None
    columns = {
        name: {str(place): one[:, place] for place in range(one.shape[1])} for name, one in numbers.items()
    }
    return Runs(columns)


def _places(name: str) -> list[tuple[str, str, str]]:
    """Names of the numbered groups in a path without their number, the path to each including it, and the rest of
    the path."""
    parts = name.split(".")
    return [
        (".".join([*parts[:place], match[1]]), ".".join(parts[: place + 1]), ".".join(parts[place + 1 :]))
        for place, part in enumerate(parts[:-1])
        if (match := NUMBERED.fullmatch(part))
    ]


def _time_of(arrays: Mapping[str, Any]) -> np.ndarray | None:
    """The time among the arrays of a run."""
    for name, values in arrays.items():
        array = np.asarray(values)
        if (
            TIME.fullmatch(name)
            and array.dtype.kind in "fiu"
            and array.size == max(array.shape, default=0) > 1
        ):
            return array.reshape(-1)
    return None


def _at_once(timed: Mapping[str, Mapping[str, Any]]) -> bool:
    times = [_time_of(arrays) for arrays in timed.values()]
    return all(
        np.array_equal(one, other) for one, other in pairwise(times) if one is not None and other is not None
    )
