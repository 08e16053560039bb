"""A folder with one text table for each stream of one recording, as loggers and `rostopic echo -p` write them: `ee.csv`,
`motor.csv`, each with its own times on a common clock. They are read as one table with the rows of all of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.record import FEWEST_COMMON_SAMPLES
from rhythmid.record.table_clock import table_clock
from rhythmid.record.text_table import TEXT
from rhythmid.record.time_origin import CALENDAR

Array = NDArray[np.float64]
TIME = "time [s]"
FEWEST = 2  # tables that are streams of one recording
COMMON = 0.5  # least share of the shorter of two tables' time that the other one must cover, too
BAGS = ("*.mcap*", "*.db3*", "*.bag", "metadata.yaml")


@dataclass(frozen=True, eq=False)
class Stream:
    """One table: its times [s] and its columns (n,) by name, without the time."""

    name: str
    time: Array
    columns: Mapping[str, Array]


def is_folder_of_tables(path: Path) -> bool:
    """Whether a path is a directory with several text tables, and with nothing of a bag."""
    try:
        return (
            path.is_dir() and not any(any(path.glob(one)) for one in BAGS) and len(_tables_in(path)) >= FEWEST
        )
    except OSError:  # an impossible path
        return False


def size_of(path: Path) -> int:
    """Size [bytes] of a table, or of all tables of a folder."""
    return sum(one.stat().st_size for one in (_tables_in(path) if path.is_dir() else [path]))


def read_folder(
    path: Path, vectors: Callable[[Path], list[tuple[str, Array]]]
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The columns of all tables, `motor.current` for the column `current` of motor.csv, on the times of all of them and
    NaN where a table has no row; and a message on each table that is left out.

    `vectors` reads the columns of one table. Raises InputError where the tables are several recordings.
    """
    streams: list[Stream] = []
    notes: list[str] = []
    for file in _tables_in(path):
        try:
            streams.append(_stream(file, vectors(file)))
        except InputError as error:
            notes.append(f"{file.name} is left out: {str(error).removeprefix(f'{file}: ')}")
    if not streams:
        raise InputError(f"{path}: none of its tables can be read: {'; '.join(notes)}")
    _require_one_recording(path, streams)
    time = np.unique(np.concatenate([one.time for one in streams]))
    columns: dict[str, Any] = {TIME: time}
    for one in streams:
        places = np.searchsorted(time, one.time)
        for name, values in one.columns.items():
            whole = np.full(len(time), np.nan)
            whole[places] = values
            columns[f"{one.name}.{name}"] = whole
    return columns, tuple(notes)


def _tables_in(path: Path) -> list[Path]:
    return sorted(one for one in path.iterdir() if one.suffix.lower() in TEXT and one.is_file())


def _stream(file: Path, columns: list[tuple[str, Array]]) -> Stream:
    """Raises InputError where the table has too few rows, or no time."""
    count = max((len(value) for _, value in columns), default=0)
    if count < FEWEST_COMMON_SAMPLES:
        raise InputError(f"{file}: it has {count} rows")
    alike = [(name, value) for name, value in columns if len(value) == count]
    clock, _ = table_clock(file, alike, [])
    found = dict(alike)
    time = found.pop(str(clock.column)) * clock.scale
    return Stream(file.name.split(".")[0], time, found)


def _require_one_recording(path: Path, streams: list[Stream]) -> None:
    """Raise InputError where the tables do not share their time, or are runs of one layout on clocks of their own."""
    apart = f"give them one by one, such as  rhythmid init {path}/*.csv"
    layouts = {tuple(one.columns) for one in streams}
    if len(layouts) < len(streams) and min(float(one.time[0]) for one in streams) < CALENDAR:
        raise InputError(
            f"{path}: tables in it have the same columns, so that they are several recordings; {apart}"
        )
    longest = max(streams, key=lambda one: float(one.time[-1] - one.time[0]))
    for one in streams:
        both = min(one.time[-1], longest.time[-1]) - max(one.time[0], longest.time[0])
        if both < COMMON * (one.time[-1] - one.time[0]):
            raise InputError(
                f"{path}: {one.name} and {longest.name} were not recorded at the same time: they are several recordings; {apart}"
            )
