"""Tables: columns of numbers in .mat, .npz, .csv and other text files, which may be compressed (.csv.gz)."""

import gzip
import re
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError

TEXT = (".csv", ".tsv", ".txt", ".dat")
COMPRESSED = ".gz"
SUFFIXES = (".mat", ".npz", *TEXT)
ONE_OF_MANY = re.compile(r"(.+)\[(\d+)\]")  # dof_pos[3]: one column of an array


def table_name(path: Path) -> str:
    """The name of a table's file without what tells its kind: `run` of `run.csv.gz`."""
    return Path(path.stem).stem if table_suffix(path) != path.suffix.lower() else path.stem


def table_suffix(path: Path) -> str:
    """The suffix that tells what kind of table a file is, in lower case: `.csv` of a compressed `run.csv.gz`, too."""
    suffix = path.suffix.lower()
    if suffix == COMPRESSED and (inner := Path(path.stem).suffix.lower()) in TEXT:
        return inner
    return suffix


@dataclass(frozen=True)
class Table:
    """Columns of one file by name, in order."""

    path: Path
    columns: dict[str, Any]

    @classmethod
    def load(cls, path: Path) -> "Table":
        """Read a table. Raises InputError when the file is missing, damaged or of an unknown kind."""
        read = {".mat": _mat, ".npz": _npz, **dict.fromkeys(TEXT, _text)}.get(table_suffix(path))
        if read is None:
            raise InputError(f"{path}: is not a table; .mat, .npz and {', '.join(TEXT)} can be read")
        try:
            return cls(path, read(path))
        except FileNotFoundError:
            raise InputError(f"{path}: no such file") from None
        except NotImplementedError:
            raise InputError(f"{path}: is a MATLAB 7.3 file; save it with  save(…, '-v7')") from None
        except InputError:
            raise
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        except Exception as error:  # the readers of damaged .mat and .npz files raise anything
            raise InputError(f"{path}: cannot be read as a table: {' '.join(str(error).split())}") from None

    def column(self, name: str | int) -> NDArray[np.float64]:
        """One column, float64[n]; `name` may be its number, or `array[3]` for a column of an array of shape [n, columns].
        Raises InputError when it is not there or no vector."""
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


def _mat(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    return {name: value for name, value in loadmat(path).items() if not name.startswith("__")}


def _npz(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _text(path: Path) -> dict[str, Any]:
    """A text table with commas, semicolons, tabs or spaces between columns; '#' starts a comment. The first line, or
    the last comment before it, may name the columns, which are otherwise called by number."""
    skipped, line, comment = 0, "", ""
    with _opened(path) as file:
        for line in file:
            if line.split("#")[0].strip():
                break
            comment = line.strip(" #\r\n") or comment
            skipped += 1
    if not line.split("#")[0].strip():
        raise InputError(f"{path}: is empty")
    delimiter = next((mark for mark in (",", ";", "\t") if mark in line), None)
    cells = _cells(line.split("#")[0], delimiter)
    named = not all(_is_number(cell) for cell in cells)
    names = cells if named else [str(number) for number in range(len(cells))]
    if not named and len(remark := _cells(comment, delimiter)) == len(names):
        names = remark
    if len(set(names)) < len(names):
        raise InputError(f"{path}: two columns have the same name in line {skipped + 1}")
    with _opened(path) as file:
        table = np.loadtxt(file, delimiter=delimiter, skiprows=skipped + named, ndmin=2, converters=_number)
    if table.size and table.shape[1] != len(names):
        raise InputError(
            f"{path}: line {skipped + 1} has {len(names)} columns, the rows have {table.shape[1]}"
        )
    return dict(zip(names, table.T.reshape(len(names), -1)))


def _opened(path: Path) -> TextIO:
    if path.suffix.lower() == COMPRESSED:
        return gzip.open(path, "rt", encoding="utf-8-sig", errors="replace")
    return path.open(encoding="utf-8-sig", errors="replace")


def _cells(line: str, delimiter: str | None) -> list[str]:
    return [cell.strip().strip("\"'") for cell in line.strip().split(delimiter)]


def _number(cell: str) -> float:
    """A cell's value; an empty one is NaN, so that the complaint can name where."""
    return float(cell) if cell.strip() else np.nan


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell == ""
    return True
