"""Splits a table with several recordings, one after the other or each in its own struct, into one table per recording.

Data sets for machine learning keep their episodes in one table, with a column that numbers them. In concatenated
logs the time restarts. MATLAB's struct arrays hold one run per element.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from shutil import rmtree
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.lib.format import write_array
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.output import require_writable
from rhythmid.record.grouped_runs import TIME, Runs
from rhythmid.record.table import Table, table_name
from rhythmid.record.table_clock import restarting

NUMBERED = re.compile(
    r"(?:.*[._ ])?(?:episode|trial|run|trajectory|segment)(?:[._ ]?(?:index|id|number|nr|no))?", re.IGNORECASE
)
NOT_IN_A_FILE_NAME = re.compile(
    r"[^\w.+-]+"
)  # of the names of columns, which may hold anything, such as `../x`
MOST_RECORDINGS = 10_000  # largest number of recordings in a table
Rows = NDArray[np.int64]


def recordings(table: Table, column: str | None = None) -> tuple[str, dict[str, Rows]]:
    """The rows of each recording by its name, and the criterion in words: the named column, else a column that
    numbers recordings, else a time that goes back.

    Raises InputError where the column does not exist, nothing separates recordings, or there are far too many.
    """
    if column is None:
        whole = (name for name, value in table.vectors() if NUMBERED.fullmatch(name) and _numbers_rows(value))
        column = next(whole, None)
    if column is not None:
        value = table.column(column)
        if not np.isfinite(value).all():
            raise InputError(f"{table.path}: column {column!r} does not number every row")
        numbers = np.unique(value)
        found = {
            _name(number): np.flatnonzero(value == number)
            for number in numbers[: MOST_RECORDINGS + 1].tolist()
        }
        why = f"column {column!r}"
    else:
        time = next((name for name, _ in table.vectors() if TIME.fullmatch(name)), None)
        time = time or restarting(list(table.vectors()))
        if time is None:
            raise InputError(
                f"{table.path}: neither a column that numbers recordings nor a time is there; name a column with --by"
            )
        back = 1 + np.flatnonzero(np.diff(table.column(time)) < 0.0)
        parts = np.split(np.arange(len(table.column(time))), back[:MOST_RECORDINGS])
        found = {str(number): rows for number, rows in enumerate(parts)}
        why = f"{time!r}, which begins anew"
    if not 1 < len(found) <= MOST_RECORDINGS:
        raise InputError(
            f"{table.path}: {why} tells {len(found)} recordings apart; 2 to {MOST_RECORDINGS} are expected"
        )
    return why, found


def _name(number: float) -> str:
    return str(int(number)) if number.is_integer() else repr(number)


def _numbers_rows(value: NDArray[np.float64]) -> bool:
    """Whether a column has whole numbers, each in one contiguous block of rows."""
    return bool(np.all(value == np.rint(value))) and len(np.unique(value)) == 1 + np.count_nonzero(
        np.diff(value)
    )


def split(table: Table, rows: Mapping[str, Rows], folder: Path) -> list[Path]:
    """Write the rows of each recording as `folder/<table>_<name>.npz`; text columns are left out.

    Raises InputError where the folder exists or cannot be written.
    """
    count = sum(map(len, rows.values()))
    columns = {
        name: values for name, values in _numbers(table.columns).items() if values.shape[:1] == (count,)
    }
    parts = ({name: values[own] for name, values in columns.items()} for own in rows.values())
    return _written(table, list(rows), parts, folder)


def split_runs(table: Table, runs: Runs, folder: Path) -> list[Path]:
    """Write the arrays of each run as `folder/<table>_<number>.npz`; texts are left out.

    Raises InputError where the folder exists or cannot be written.
    """
    numbered = runs.numbered()
    return _written(table, list(numbered), map(_numbers, numbered.values()), folder)


def _numbers(columns: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """The columns that hold numbers."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    return {name: values for name, values in arrays.items() if values.dtype.kind in "fiub"}


def _as_file_names(names: list[str]) -> list[str]:
    """Names of recordings as parts of the names of files, all different."""
    found: list[str] = []
    for name in names:
        plain = own = NOT_IN_A_FILE_NAME.sub("_", name)
        number = 0
        while own in found:
            number += 1
            own = f"{plain}_{number}"
        found.append(own)
    return found


def _written(
    table: Table, names: list[str], parts: Iterable[Mapping[str, NDArray[Any]]], folder: Path
) -> list[Path]:
    """Files with the parts; all of them are written or none."""
    if folder.exists():
        raise InputError(f"{folder}: exists already; name another folder or remove it")
    require_writable(folder)
    partial = folder.with_name(f".{folder.name}.partial")
    made = [f"{table_name(table.path)}_{name}.npz" for name in _as_file_names(names)]
    try:
        partial.mkdir(parents=True, exist_ok=True)
        for name, columns in zip(made, parts, strict=True):
            with ZipFile(partial / name, "w") as archive:  # savez accepts no column called `file`
                for column, values in columns.items():
                    with archive.open(f"{column}.npy", "w") as file:
                        write_array(file, values, allow_pickle=False)
        partial.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    finally:
        rmtree(partial, ignore_errors=True)  # left over after an interruption or on a full disk
    return [folder / name for name in made]
