"""Tables: columns of numbers in .mat, .h5, .npz, .parquet, .xlsx, .json, .csv and other text files, also compressed
(.csv.gz)."""

import math
import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.compression import largest
from rhythmid.record.counter_wrap import unwrapped
from rhythmid.record.excel_table import EXCEL, read_excel
from rhythmid.record.folder_of_tables import is_folder_of_tables, read_folder
from rhythmid.record.foreign_file import refuse_foreign
from rhythmid.record.hdf5_table import NUMBERS, is_hdf5, read_hdf5
from rhythmid.record.joined_stamps import with_joined_stamps
from rhythmid.record.json_table import JSON, read_json
from rhythmid.record.lfs_pointer import check_content
from rhythmid.record.matlab_class import signals_of
from rhythmid.record.matlab_objects import complaint_of_objects
from rhythmid.record.own_process import arrays_in_own_process
from rhythmid.record.paired_times import with_common_time
from rhythmid.record.placeholder import Placeholder, without_placeholders
from rhythmid.record.rows_without_time import without_untimed_rows
from rhythmid.record.table_clock import is_called_time
from rhythmid.record.text_file import COMPRESSED
from rhythmid.record.text_table import TEXT, text_table
from rhythmid.record.unfilled_rows import without_unfilled_rows

HDF5 = (".h5", ".hdf5")
SUFFIXES = (".mat", *HDF5, ".npz", ".npy", ".parquet", *EXCEL, *JSON, *TEXT)
OF_OBJECTS = "it holds Python objects, which are code and are not opened; write its arrays by  numpy.savez(FILE, q=q, tau=tau)"
WIDEST = 64  # columns of an array above which it is an image or a scan, not joints
LABELLED = (
    ("label", "values"),
    ("Name", "Data"),
)  # fields of a struct: name of a channel, and its numbers
ONE_OF_MANY = re.compile(r"(.+)\[(\d+)\]")  # dof_pos[3]: one column of an array


def is_table(path: Path) -> bool:
    """Whether a path is named as a table, or is a folder with the tables of one recording."""
    return table_suffix(path) in SUFFIXES or is_folder_of_tables(path)


def table_name(path: Path) -> str:
    """The name of a table's file without its suffixes: `run` for `run.csv.gz`; a folder's own name."""
    if path.is_dir():
        return path.resolve().name
    return Path(path.stem).stem if table_suffix(path) != path.suffix.lower() else path.stem


def table_suffix(path: Path) -> str:
    """The suffix for the kind of table, in lower case: `.csv` also for a compressed `run.csv.gz`."""
    suffix = path.suffix.lower()
    if suffix == COMPRESSED and (inner := Path(path.stem).suffix.lower()) in (*JSON, *TEXT):
        return inner
    return suffix


@dataclass(frozen=True)
class Table:
    """Columns of one file by name, in order, messages about how it was read, one line each, and the placeholders
    that were read as missing, by column."""

    path: Path
    columns: dict[str, Any]
    notes: tuple[str, ...] = ()
    placeholders: Mapping[str, Placeholder] = field(default_factory=dict[str, Placeholder])

    @classmethod
    def load(cls, path: Path) -> "Table":
        """Read a table. Raises InputError when the file is missing, damaged or of an unknown kind."""
        readers = {
            ".mat": _mat, ".npz": _npz, ".npy": _npy, ".parquet": _parquet, **dict.fromkeys(HDF5, read_hdf5), **dict.fromkeys(JSON, read_json),
            **dict.fromkeys(TEXT, text_table), **dict.fromkeys(EXCEL, read_excel),
        }  # fmt: skip
        folder, read = is_folder_of_tables(path), readers.get(table_suffix(path))
        if read is None and not folder:
            refuse_foreign(path)
            raise InputError(
                f"{path}: is not a table; .mat, {', '.join(HDF5)}, .npz, .npy, .parquet, {', '.join((*EXCEL, *JSON, *TEXT))} can be read"
            )
        try:
            if read is None or folder:
                found = read_folder(path, lambda file: list(cls.load(file).vectors()))
            else:
                check_content(path)
                found = read(path)
            columns, notes = found if isinstance(found, tuple) else (found, ())
            columns, unfilled = without_unfilled_rows(with_common_time(with_joined_stamps(columns)))
            columns, untimed = without_untimed_rows(columns)
            notes = (*notes, *unfilled, *untimed)
        except FileNotFoundError:
            raise InputError(f"{path}: no such file") from None
        except InputError:
            raise
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        except Exception as error:  # the readers may raise any exception on damaged .mat and .npz files
            raise InputError(f"{path}: cannot be read as a table: {' '.join(str(error).split())}") from None
        continued = {name: unwrapped(one) for name, one in columns.items() if is_called_time(name)}
        notes = (*notes, *(f"{path.name}: {name!r} {said}" for name, (_, said) in continued.items() if said))
        times = {name: one for name, (one, _) in continued.items()}
        others = {name: _upright(one) for name, one in columns.items() if name not in times}
        told, placeholders = without_placeholders(others)
        return cls(path, {name: {**times, **told}[name] for name in columns}, notes, placeholders)

    def placeholder(self, name: str | int) -> Placeholder | None:
        """The placeholders of a column, named as for `column`; None where it has none."""
        if isinstance(name, int) and str(name) not in self.columns:
            name = list(self.columns)[name]
        return self.placeholders.get(str(name))

    def vectors(self) -> Iterator[tuple[str, NDArray[np.float64]]]:
        """Columns of numbers by name; arrays are split into columns."""
        for name, values in self.columns.items():
            array = np.asarray(values)
            if array.dtype.kind not in "fiub":
                continue
            if array.ndim == 2 and min(array.shape) > 1:
                if array.shape[1] <= WIDEST:
                    parts = [f"{name}[{number}]" for number in range(array.shape[1])]
                    yield from ((part, self.column(part)) for part in parts)
            elif array.size == max(array.shape, default=0) and array.size > 1:
                yield str(name), self.column(name)

    def words(self) -> Iterator[tuple[str, str]]:
        """Text columns of a text table by name, each with its first cell that is not a number."""
        for name, values in self.columns.items():
            if isinstance(values, np.ndarray) and values.dtype.kind == "O" and values.ndim == 1:
                word = next((cell for cell in values if isinstance(cell, str) and not _is_number(cell)), None)
                if word is not None:
                    yield name, word

    def column(self, name: str | int) -> NDArray[np.float64]:
        """One column, float64[n]. `name` may be its index, or `array[3]` for a column of an array of shape [n, columns].
        Raises InputError when it does not exist or is no vector."""
        names = list(self.columns)
        if isinstance(name, int) and str(name) not in self.columns:
            if not 0 <= name < len(names):
                raise InputError(
                    f"{self.path}: has {len(names)} columns, counted from 0, but not column {name}"
                )
            name = names[name]
        if str(name) not in self.columns and (part := ONE_OF_MANY.fullmatch(str(name))):
            if part[1] in self.columns:
                return self._of_array(part[1], int(part[2]))
        if str(name) not in self.columns:
            near = get_close_matches(str(name), names, 1)
            mend = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(names) or 'none'}"
            raise InputError(f"{self.path}: has no column {name!r}; {mend}")
        values = np.asarray(self.columns[str(name)])
        self._check_real(str(name), values)
        if values.size != max(values.shape, default=0):
            choice = f", such as {name}[0]" if values.ndim == 2 else ""
            raise InputError(
                f"{self.path}: column {name!r} has shape {values.shape}; a vector is expected{choice}"
            )
        return values.astype(np.float64).reshape(-1)

    def _of_array(self, name: str, number: int) -> NDArray[np.float64]:
        values = np.asarray(self.columns[name])
        self._check_real(name, values)
        if values.ndim != 2:
            raise InputError(
                f"{self.path}: column {name!r} has shape {values.shape}: no columns to choose from"
            )
        if number >= values.shape[1]:
            raise InputError(
                f"{self.path}: {name!r} has {values.shape[1]} columns, counted from 0, but not column {number}"
            )
        return values[:, number].astype(np.float64)

    def _check_real(self, name: str, values: NDArray[Any]) -> None:
        if values.dtype.kind not in "fiub":
            raise InputError(f"{self.path}: column {name!r} does not hold real numbers")


def _upright(values: Any) -> Any:
    """An array as columns, also if it is transposed, as from Simulink's To File: one row per signal, with more
    values than any array has columns."""
    across = (
        isinstance(values, np.ndarray) and values.ndim == 2 and 1 < len(values) <= WIDEST < values.shape[1]
    )
    return values.T if across else values


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", ".") or "nan")
    except ValueError:
        return False
    return True


def _mat(path: Path) -> dict[str, Any]:
    if is_hdf5(path):  # version 7.3
        return read_hdf5(path)
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque, MatReadWarning

    def read() -> dict[str, NDArray[Any]]:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", MatReadWarning
            )  # it reads several objects as one unnamed variable
            found = loadmat(path, simplify_cells=True)
            opaque = [value for value in found.values() if isinstance(value, MatlabOpaque)]
            signals = signals_of(path, found) if opaque else {}
        objects = {_first(one["s0"]): _first(one["s2"]) for one in opaque}  # names and classes
        told = {
            name: value
            for name, value in found.items()
            if not name.startswith("__") and not isinstance(value, MatlabOpaque)
        } | signals
        arrays = dict(_flat(told))
        if objects and not any(array.dtype.kind in NUMBERS for array in arrays.values()):
            raise ValueError(complaint_of_objects(objects))
        return arrays

    return dict(arrays_in_own_process(read, f"{path}: cannot be read as a table"))


def _first(texts: NDArray[Any]) -> str:
    return np.ravel(texts)[0].decode(errors="replace")


def _flat(struct: dict[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Arrays in nested structs by path, in MATLAB's notation: `data.q`, `runs[0].q` in a struct array."""
    struct = _with_label(struct)
    for name, value in struct.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{above}{name}.")
        elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
            for number, one in enumerate(value):
                yield from _flat(one, f"{above}{name}[{number}].")
        elif _is_cell(value) and (rows := _rows_of_cells(np.ravel(value))) is not None:
            yield above + name, rows
        elif _is_cell(value):
            for number, one in enumerate(np.ravel(value)):
                yield f"{above}{name}[{number}]", np.atleast_1d(np.asarray(one))
        else:
            yield above + name, np.atleast_1d(np.asarray(value))


def _with_label(struct: dict[str, Any]) -> dict[str, Any]:
    """A struct whose numbers are named by the label beside them: Simulink's `label` of `values`, dSPACE's `Name` of
    `Data`."""
    for label, numbers in LABELLED:
        name = struct.get(label)
        if isinstance(name, str) and name.strip() and numbers in struct and name not in struct:
            return {name.strip() if key == numbers else key: value for key, value in struct.items()}
    return struct


def _is_cell(value: Any) -> bool:
    """Whether it is a MATLAB cell that holds arrays."""
    return isinstance(value, np.ndarray) and value.dtype.hasobject and any(np.ndim(one) for one in value.flat)


def _rows_of_cells(cells: NDArray[Any]) -> NDArray[Any] | None:
    """One row of numbers per cell, if there are more cells than an array has columns, and each has as few values as
    a row."""
    shapes = {np.shape(one) for one in cells} if len(cells) > WIDEST else set()
    if len(shapes) != 1 or not 0 < math.prod(shapes.pop()) <= WIDEST:
        return None
    rows = np.stack(list(cells)).reshape(len(cells), -1)
    return rows if rows.dtype.kind in NUMBERS else None


def _npz(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        if not isinstance(file, np.lib.npyio.NpzFile) or file.zip is None:
            raise ValueError("it is no archive of arrays")
        _check_size(path, sum(member.file_size for member in file.zip.infolist()))
        return {name: file[name] for name in file.files}


def _npy(path: Path) -> dict[str, Any]:
    """The columns of an array by index, or the fields of a record array by name."""
    try:  # it rejects a file that claims to be longer than it is
        array = np.array(np.load(path, allow_pickle=False, mmap_mode="r"))
    except ValueError as error:
        if "object" not in str(error).lower():
            raise
        raise ValueError(OF_OBJECTS) from None
    if array.dtype.names:
        return {name: array[name] for name in array.dtype.names}
    array = _upright(array)
    if array.ndim != 2 or array.shape[1] > WIDEST:
        raise ValueError(f"its array has the shape {array.shape}; rows and columns are expected")
    return {str(number): column for number, column in enumerate(array.T)}


def _check_size(path: Path, size: int) -> None:
    """Raise InputError where a file claims to hold more bytes than its own size allows."""
    if size > largest(path.stat().st_size):
        raise InputError(
            f"{path}: claims to hold {size} bytes in {path.stat().st_size}: such tables are not read"
        )


def _parquet(path: Path) -> dict[str, Any]:
    try:
        from pyarrow.parquet import read_metadata, read_table
    except ImportError:
        raise InputError(
            f"{path}: reading Parquet needs pyarrow: pip install pyarrow, or save the table as .csv"
        ) from None
    if not path.exists():
        raise FileNotFoundError
    about = read_metadata(path)
    _check_size(path, about.num_rows * about.num_columns * np.dtype(float).itemsize)
    table = read_table(path)
    found: dict[str, Any] = {}
    for name, column in zip(table.column_names, table.columns):
        values = column.to_numpy()
        if values.dtype.kind in "mM":  # times, converted to seconds
            values = (
                values.astype("datetime64[ns]" if values.dtype.kind == "M" else "timedelta64[ns]").astype(
                    np.int64
                )
                * 1e-9
            )
        if values.dtype.kind == "O" and len(values) and isinstance(values[0], np.ndarray):
            values = np.stack(list(values))  # one list of numbers per row
        found[name] = values
    return found
