"""Text tables as programs write them: comment lines, a title, names and units above the numbers; commas, semicolons, tabs or
spaces between the columns; decimal points or commas; cells in quotes.

Nothing has to be said of a file: the separator is the one by which most lines are rows of numbers of one length.
"""

import csv
import gzip
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.clock_time import seconds
from rhythmid.record.compression import largest
from rhythmid.record.text_head import names_of

TEXT = (".csv", ".tsv", ".txt", ".dat")
COMPRESSED = ".gz"
COMMENTS = ("#", "%")
SEPARATORS = ("\t", ";", ",", None)  # None: any number of spaces; in this order where two do equally well
EMPTY = " \t\r\n;,\"'"  # what a line of empty cells is made of
LOOKED_AT = 200  # lines from which the dialect is told: more than any head has
ACROSS = 10  # times as many columns as rows, from which the lines of a table without names are its columns
SAMPLE = 1 << 16  # bytes from which the encoding is told
BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


@dataclass(frozen=True)
class Dialect:
    """How a text table is written.

    Attributes
    ----------
    separator : between columns; None stands for any number of spaces.
    decimal : "." or ",".
    first : number of the line, counted from 0, that holds the first row of numbers; the number of lines where none does.
    names : of the columns, with their units where the file tells them.
    numeric : positions of the columns that hold numbers.
    """

    separator: str | None
    decimal: str
    first: int
    names: tuple[str, ...]
    numeric: tuple[int, ...]


def read_text(path: Path) -> dict[str, Any]:
    """Columns of a text table by name: float64[n] each, dates and times of day in seconds, text[n] where a column holds words.

    Raises InputError where the file is empty, its names are not unique or do not belong to the rows; ValueError where a row
    is damaged.
    """
    encoding = _encoding(path)
    if path.suffix.lower() == COMPRESSED:
        _check_size(path)
    with _opened(path, encoding) as file:
        dialect = dialect_of(list(islice(file, LOOKED_AT)), str(path))
    count = len(dialect.names)
    words = [place for place in range(count) if place not in dialect.numeric]
    with _opened(path, encoding) as file:
        numbers = _rows(islice(file, dialect.first, None), dialect, dialect.numeric)
    unnamed = dialect.names == tuple(map(str, range(count)))
    if unnamed and not words and ACROSS * len(numbers) <= count:
        return {str(place): row for place, row in enumerate(numbers)}
    found: dict[str, Any] = {
        dialect.names[place]: column for place, column in zip(dialect.numeric, numbers.T)
    }
    if words:
        with _opened(path, encoding) as file:
            lines = (line for line in islice(file, dialect.first, None) if _content(line))
            cells = [_cells(line, dialect.separator) for line in lines]
        found |= {dialect.names[place]: _words([row[place] for row in cells]) for place in words}
    return {name: found[name] for name in dialect.names}


def dialect_of(lines: list[str], name: str) -> Dialect:
    """The dialect of a table that begins with these lines. Raises InputError; `name` stands for the file."""
    used = [(number, line) for number, line in enumerate(lines) if _content(line)]
    if not used:
        raise InputError(f"{name}: is empty")
    separator, decimal, rows = max(_readings([line for _, line in used]), key=lambda one: _worth(one[2]))
    if not any(rows):  # no numbers: names alone
        separator = max(SEPARATORS, key=lambda one: len(_cells(used[-1][1], one)))
        head = _cells(used[-1][1], separator)
        return Dialect(separator, decimal, len(lines), tuple(head), tuple(range(len(head))))
    split = [_cells(line, separator) for _, line in used]
    place = _first_row(split, rows, decimal)
    cells = split[place]
    numeric = tuple(index for index, cell in enumerate(cells) if _number(cell, decimal) is not None)
    head = names_of(split[:place], len(cells))
    if head is None:
        head = _remark(lines[: used[place][0]], separator, len(cells)) or [str(n) for n in range(len(cells))]
    if not head[-1] and not cells[-1]:
        head = head[:-1]
    if len(head) == len(cells) - 1 and not cells[-1]:  # every row ends with a separator
        numeric = numeric[:-1]
    elif len(head) != len(cells):
        line = used[place - 1][0] + 1
        raise InputError(f"{name}: line {line} has {len(head)} columns, the rows have {len(cells)}")
    if len(set(head)) < len(head):
        twice = next(one for one, count in Counter(head).items() if count > 1)
        line = used[place - 1][0] + 1 if place else 1
        raise InputError(
            f"{name}: two columns have the same name in line {line} ({twice!r}); rename one of them"
        )
    return Dialect(separator, decimal, used[place][0], tuple(head), numeric)


def _readings(lines: list[str]) -> Iterator[tuple[str | None, str, list[int]]]:
    """Separator, decimal mark, and of each line how many numbers it holds where it is a row, else 0."""
    for separator in SEPARATORS:
        split = [_cells(line, separator) for line in lines]
        for decimal in (".",) if separator == "," and not any('"' in line for line in lines) else (".", ","):
            count = [sum(bool(cell) and _number(cell, decimal) is not None for cell in row) for row in split]
            usual = Counter(len(row) for row, numbers in zip(split, count) if numbers).most_common(1)
            width = usual[0][0] if usual else 0
            yield separator, decimal, [n if len(row) == width else 0 for row, n in zip(split, count)]


def _worth(rows: list[int]) -> tuple[int, int]:
    """How well a reading does: numbers that are told apart in rows, and the number of rows."""
    return sum(rows), sum(1 for row in rows if row)


def _remark(lines: list[str], separator: str | None, count: int) -> list[str] | None:
    """Names, and units, in the last comment lines that have as many entries as there are columns."""
    told = [_cells(line.strip().lstrip("#% "), separator) for line in lines if line.strip().lstrip("#% ")]
    while told and len(told[-1]) != count:
        told.pop()
    return names_of(told, count)


def _first_row(rows: list[list[str]], numbers: list[int], decimal: str) -> int:
    """Which line is the first of numbers: not one of a title or of units that holds a number, too.

    Such a line begins with a word where most rows have a number, and has no more numbers than words.
    """
    begin = next(place for place, count in enumerate(numbers) if count)
    usual = Counter(count for count in numbers if count).most_common(1)[0][0]
    for place in range(begin, len(rows)):
        if not numbers[place]:
            continue
        if 2 * numbers[place] > usual or not _begins_with_word(rows[place], rows[place + 1 :], decimal):
            return place
    return begin


def _begins_with_word(row: list[str], below: list[list[str]], decimal: str) -> bool:
    """Whether the first cell that is filled is no number where most of the rows below have one."""
    place = next((place for place, cell in enumerate(row) if cell), 0)
    if _number(row[place], decimal) is not None:
        return False
    there = [
        bool(cells[place]) and _number(cells[place], decimal) is not None
        for cells in below
        if len(cells) == len(row)
    ]
    return 2 * sum(there) > len(there)


def _rows(lines: Iterable[str], dialect: Dialect, columns: tuple[int, ...]) -> np.ndarray:
    """Numbers [rows, columns]; the slow way with Python's own conversion only where cells are empty or have decimal commas."""

    def value(cell: str) -> float:
        found = _number(cell, dialect.decimal)
        return float(cell) if found is None else found

    def read(lines: Iterable[str], converters: Any) -> np.ndarray:
        return np.loadtxt(
            lines, delimiter=dialect.separator, comments=COMMENTS[0], quotechar='"', usecols=columns, ndmin=2,
            converters=converters,
        )  # fmt: skip

    held = [_own(line, dialect.separator) for line in lines if _content(line)]
    if not held or not columns:
        return np.empty((0, len(columns)))
    usual = len(_cells(held[0], dialect.separator))
    for line in held:  # loadtxt itself looks at no column but those that are used
        if line[0] not in COMMENTS and '"' not in line and dialect.separator is not None:
            if line.count(dialect.separator) + 1 != usual:
                raise ValueError(
                    f"a row has {line.count(dialect.separator) + 1} cells, the first has {usual}"
                )
    if dialect.decimal == "." and '"' not in held[0]:
        try:
            return read(held, None)
        except ValueError:
            pass  # an empty cell, say
    return read(held, value)


def _own(line: str, separator: str | None) -> str:
    """A line without what a spreadsheet has appended that took it for one cell: the commas of empty cells."""
    line = line.strip(" \r\n")
    return line if separator == "," else line.rstrip(",")


def _words(cells: list[str]) -> np.ndarray:
    """A column of seconds where its cells are times, of words else."""
    found = seconds(cells)
    return np.array(cells, dtype=object) if found is None else found  # fixed-width text would take much more


def _content(line: str) -> bool:
    """Whether a line is anything but a comment or empty cells, of which spreadsheets leave thousands below a table."""
    return bool(line.strip(EMPTY)) and line.lstrip()[0] not in COMMENTS


def _cells(line: str, separator: str | None) -> list[str]:
    """Cells of a line, without quotes and the spaces around them."""
    if separator is None:
        return next(csv.reader([" ".join(line.split())], delimiter=" ", skipinitialspace=True), [])
    row = next(csv.reader([_own(line, separator)], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip().strip("'").strip() for cell in row]


def _number(cell: str, decimal: str) -> float | None:
    """A cell's value, None where it is no number; an empty one is NaN, so that the complaint can name where."""
    cell = cell.strip().strip("\"'")
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    try:
        return float(cell) if cell else np.nan
    except ValueError:
        return None


def _encoding(path: Path) -> str:
    """UTF-8 or UTF-16 by its mark, else UTF-8 where the beginning is, else Windows' own."""
    with gzip.open(path) if path.suffix.lower() == COMPRESSED else path.open("rb") as file:
        start = file.read(SAMPLE)
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if start.startswith(mark):
            return encoding
    try:
        start[: start.rfind(b"\n") + 1].decode()
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def _check_size(path: Path) -> None:
    """Raise InputError where a compressed table holds more than a table could."""
    most = largest(path.stat().st_size)
    size = 0
    with gzip.open(path) as file:
        while piece := file.read(SAMPLE):
            size += len(piece)
            if size > most:
                raise InputError(
                    f"{path}: holds more than {most} bytes in {path.stat().st_size}: such tables are not read"
                )


def _opened(path: Path, encoding: str) -> TextIO:
    if path.suffix.lower() == COMPRESSED:
        return gzip.open(path, "rt", encoding=encoding, errors="replace")
    return path.open(encoding=encoding, errors="replace")
