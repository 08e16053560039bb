"""The rows of a text table: finds their lines and converts them to numbers."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rhythmid.record.text_cells import cells_of, content, number_of, own

REMARK = re.compile(r"\s#.*")  # after a row; a # within a cell, as in 1.#QNAN, is no remark
SHOWN = 40  # characters of a line quoted in a message


@dataclass(frozen=True, eq=False)
class Rows:
    """The lines that hold rows, and their line numbers in the file, counted from 1."""

    texts: list[str]
    numbers: list[int]

    def __len__(self) -> int:
        return len(self.texts)

    def complaint(self, place: int, why: str) -> ValueError:
        """Message about a wrong row, with advice."""
        text = self.texts[place]
        shown = text if len(text) <= SHOWN else f"{text[:SHOWN]}…"
        return ValueError(
            f"line {self.numbers[place]} ({shown}) {why}; delete what does not belong to the table"
        )


def rows_in(lines: Iterable[str], first: int, separator: str | None, head: Sequence[str]) -> Rows:
    """The lines that hold rows; `first` is the line number of the first, counted from 0, and `head` the cells of
    the line above it.

    A repeated head, as after a restart of the logger, is no row. Neither is an incomplete last line, without a line
    end and with fewer cells, as after the logger was switched off. Raises ValueError where a line has another
    number of cells than the first.
    """
    found = Rows([], [])
    last, begin = "", head[0] if head else ""
    for number, line in enumerate(lines, start=first + 1):
        if not content(line):
            continue
        last = line
        if begin and begin in line and cells_of(line, separator) == list(head):
            continue
        found.texts.append(own(REMARK.sub("", line) if "#" in line else line, separator))
        found.numbers.append(number)
    if not found.texts or separator is None:
        return found
    usual = len(cells_of(found.texts[0], separator))
    if len(found) > 1 and last[-1:] not in "\n\r" and len(cells_of(found.texts[-1], separator)) < usual:
        found.texts.pop()
        found.numbers.pop()
    for place, text in enumerate(found.texts):  # loadtxt itself checks only the columns that are used
        if text.count(separator) + 1 != usual and '"' not in text:
            raise found.complaint(place, f"has {text.count(separator) + 1} cells, the first row has {usual}")
    return found


def numbers_of(rows: Rows, separator: str | None, decimal: str, columns: Sequence[int]) -> np.ndarray:
    """Numbers [rows, columns]. Python's own, slow conversion is used only where cells are empty or have decimal commas.

    Raises ValueError where a cell is no number.
    """

    def value(cell: str) -> float:
        found = number_of(cell, decimal)
        return float(cell) if found is None else found

    def read(converters: Any) -> np.ndarray:
        return np.loadtxt(
            rows.texts, delimiter=separator, comments=None, quotechar='"', usecols=tuple(columns), ndmin=2,
            converters=converters,
        )  # fmt: skip

    if not rows or not columns:
        return np.empty((0, len(columns)))
    if decimal == "." and '"' not in rows.texts[0]:
        try:
            return read(None)
        except ValueError:
            pass  # for example an empty cell
    try:
        return read(value)
    except ValueError:
        raise _first_wrong(rows, separator, decimal, columns) from None


def _first_wrong(rows: Rows, separator: str | None, decimal: str, columns: Sequence[int]) -> ValueError:
    """Message about the first line that is no row."""
    usual = len(cells_of(rows.texts[0], separator))
    for row, text in enumerate(rows.texts):
        cells = cells_of(text, separator)
        if len(cells) != usual:
            return rows.complaint(row, f"has {len(cells)} cells, the first row has {usual}")
        for place in columns:
            if number_of(cells[place], decimal) is None:
                return rows.complaint(
                    row, f"holds no number in column {place + 1}, where {cells[place]!r} stands"
                )
    return ValueError("its rows hold what is no number")
