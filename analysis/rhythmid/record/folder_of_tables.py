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
from rhythmid.record.stream import Stream, on_all_times
from rhythmid.record.table_clock import table_clock
from rhythmid.record.text_table import TEXT
from rhythmid.record.time_origin import CALENDAR

Array = NDArray[np.float64]
TIME = "time [s]"
FEWEST = 2  # tables that are streams of one recording
COMMON = 0.5  # least share of the shorter of two tables' time that the other one must cover, too
EVEN = 1e-3  # share of a step by which even stamps may differ: they are written in whole us or ms
BAGS = ("*.mcap*", "*.db3*", "*.bag", "metadata.yaml")


@dataclass(frozen=True, eq=False)
class Part:
    """One table of a folder: its name, and its columns (n,) by name, without words."""

    name: str
    columns: list[tuple[str, Array]]

    def named(self, column: str) -> str:
        """The name of a column in the table of the whole folder."""
        return f"{self.name}.{column}"

    @property
    def rows(self) -> int:
        return len(self.columns[0][1])


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
    NaN where a table has no row; and a message on each table that is left out. A table that holds nothing but a time is
    the clock of those without one that have as many rows. Where none of them has a time, their rows are of one clock, and
    the columns are those of all.

    `vectors` reads the columns of one table. Raises InputError where the tables are several recordings.
    """
    streams: dict[str, Stream] = {}
    untimed: list[tuple[Part, str]] = []
    notes: list[str] = []
    for file in _tables_in(path):
        try:
            part = _part(file, vectors(file))
        except InputError as error:
            notes.append(_left_out(file, error))
            continue
        try:
            streams[part.name] = _stream(file, part)
        except InputError as error:
            untimed.append((part, _left_out(file, error)))
    if not streams and untimed:
        return {part.named(name): value for part, _ in untimed for name, value in part.columns}, ()
    notes += _timed_by_a_clock(streams, untimed)
    if not streams:
        raise InputError(f"{path}: none of its tables can be read: {'; '.join(notes)}")
    _require_one_recording(path, streams)
    return on_all_times(list(streams.values()), TIME), tuple(notes)


def _timed_by_a_clock(streams: dict[str, Stream], untimed: list[tuple[Part, str]]) -> list[str]:
    """Give the tables without a time that of the only table that holds nothing else, where they have as many rows, and
    return the messages on the others."""
    clocks = [one for one in streams.values() if not one.columns]
    left: list[str] = []
    for part, message in untimed:
        if len(clocks) == 1 and part.rows == len(clocks[0].time):
            values = {part.named(name): value for name, value in part.columns}
            streams[part.name] = Stream(clocks[0].time, values)
        else:
            left.append(message)
    return left


def _left_out(file: Path, error: InputError) -> str:
    return f"{file.name} is left out: {str(error).removeprefix(f'{file}: ')}"


def _tables_in(path: Path) -> list[Path]:
    return sorted(one for one in path.iterdir() if one.suffix.lower() in TEXT and one.is_file())


def _part(file: Path, columns: list[tuple[str, Array]]) -> Part:
    """Raises InputError where the table has too few rows."""
    count = max((len(value) for _, value in columns), default=0)
    if count < FEWEST_COMMON_SAMPLES:
        raise InputError(f"{file}: it has {count} rows")
    return Part(file.name.split(".")[0], [(name, value) for name, value in columns if len(value) == count])


def _stream(file: Path, part: Part) -> Stream:
    """Raises InputError where the table has no time."""
    clock, _ = table_clock(file, part.columns, [])
    found = dict(part.columns)
    time = found.pop(str(clock.column)) * clock.scale
    return Stream(time, {part.named(name): value for name, value in found.items()})


def _require_one_recording(path: Path, streams: Mapping[str, Stream]) -> None:
    """Raise InputError where the tables do not share their time, or are runs of one layout on clocks of their own."""
    apart = f"give them one by one, such as  rhythmid init {path}/*.csv"
    layouts: dict[tuple[str, ...], Stream] = {}
    for own, one in streams.items():
        first = layouts.setdefault(tuple(name.removeprefix(f"{own}.") for name in one.columns), one)
        dated = min(float(each.time[0]) for each in streams.values()) >= CALENDAR
        if first is one or dated or _has_the_same_stamps(first.time, one.time):
            continue
        raise InputError(
            f"{path}: tables in it have the same columns, so that they are several recordings; {apart}"
        )
    longest = max(streams, key=lambda own: float(streams[own].time[-1] - streams[own].time[0]))
    for own, one in streams.items():
        other = streams[longest]
        both = min(one.time[-1], other.time[-1]) - max(one.time[0], other.time[0])
        if both < COMMON * (one.time[-1] - one.time[0]):
            raise InputError(
                f"{path}: {own} and {longest} were not recorded at the same time: they are several recordings; {apart}"
            )


def _has_the_same_stamps(first: Array, second: Array) -> bool:
    """Whether two tables were written row by row with one stamp each, or have the times of one clock: no two recordings
    have the same uneven stamps, while even ones that begin at zero are those of any."""
    if first is second:
        return True
    if len(first) != len(second) or not np.array_equal(first, second):
        return False
    step = np.diff(first)
    return bool(np.ptp(step) > EVEN * np.median(step))
