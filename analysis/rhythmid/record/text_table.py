"""Text tables of other programs: comment lines, a title, names and units above the numbers; commas, semicolons,
tabs or spaces between the columns; decimal points or commas; cells in quotes.

The format need not be declared: the separator is the one with which most lines are rows of numbers of equal length.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.broken_lines import unbroken
from rhythmid.record.clock_time import seconds
from rhythmid.record.codesys_trace import is_trace, read_trace
from rhythmid.record.heading import heading_of
from rhythmid.record.labelled_rows import labels_of, read_labelled
from rhythmid.record.list_cells import list_of, lists_of
from rhythmid.record.lvm_head import lvm_head
from rhythmid.record.matrix_literal import rows_of_matrix
from rhythmid.record.measured_cells import is_measured, measured
from rhythmid.record.optional_cells import optional_cells
from rhythmid.record.settings_above import without_settings
from rhythmid.record.stated_above import stated_above
from rhythmid.record.text_cells import COMMENTS, cells_of, content, is_missing, is_number, number_of
from rhythmid.record.text_file import opened
from rhythmid.record.text_head import names_of
from rhythmid.record.text_rows import Rows, numbers_of, rows_in

TEXT = (".csv", ".tsv", ".txt", ".dat", ".lvm", ".log")
SEPARATORS = ("\t", ";", ",", None)  # None: any number of spaces; in this order of preference
LOOKED_AT = 200  # lines used to detect the dialect: more than any head has
UNIT_OR_END = re.compile(r"(\s*[\[({<][^\[({<]*)?$")  # end of a column's name
LONGEST_LABEL = 3  # words before the colon of a labelled comment: `Names of columns: t y u`
WIDE_GAP = re.compile(r"\s{2,}")  # between names of several words
ACROSS = 10  # ratio of columns to rows above which the lines of a table without names are its columns


@dataclass(frozen=True)
class Dialect:
    """Notation of a text table.

    Attributes
    ----------
    separator : between columns; None stands for any number of spaces.
    decimal : "." or ",".
    first : number of the line, counted from 0, with the first row of numbers; the number of lines where there is none.
    names : of the columns, with their units where the file states them.
    numeric : indices of the columns that hold numbers.
    head : cells of the line above the rows.
    notes : messages about the names, one line each.
    settings : numbers by name that stand above the table.
    """

    separator: str | None
    decimal: str
    first: int
    names: tuple[str, ...]
    numeric: tuple[int, ...]
    head: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    settings: Mapping[str, float] = field(default_factory=dict[str, float])


def read_text(path: Path) -> dict[str, Any]:
    """The columns of a text table; errors as of `text_table`."""
    return text_table(path)[0]


def text_table(path: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Columns of a text table by name, and messages about the file, one line each.

    A column is float64[n], float64[n, k] where cells are lists, or text[n] where it holds words. Dates and times of
    day are in seconds.

    Raises InputError where the file is empty or its names do not match the rows; ValueError where a row is damaged.
    """
    with opened(path) as file:
        begin = list(islice(unbroken(rows_of_matrix(file)), LOOKED_AT))
    if labels := labels_of(begin):
        with opened(path) as file:
            labelled = read_labelled(file, labels)
        return dict[str, Any](labelled.columns), labelled.notes
    if is_trace(begin):
        with opened(path) as file:
            return dict[str, Any](read_trace(file)), ()
    with opened(path) as file:
        return table_of(file, str(path), begin)


def table_of(
    lines: Iterable[str], name: str, begin: list[str] | None = None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Columns of the lines of a text table, and messages, as of `text_table`. `name` is the table's in messages, and
    `begin` its first lines, without broken cells, where `lines` can be read only once."""
    if begin is None:
        lines = list(lines)
        begin = list(islice(unbroken(rows_of_matrix(lines)), LOOKED_AT))
    optional = optional_cells(begin)
    if optional is not None:
        begin = list(optional.filled(begin))
    dialect, lvm = dialect_of(begin, name), lvm_head(begin)
    whole = unbroken(rows_of_matrix(lines))
    body = islice(whole if optional is None else optional.filled(whole), dialect.first, None)
    rows = rows_in(body, dialect.first, dialect.separator, dialect.head)
    count = len(dialect.names)
    words = [place for place in range(count) if place not in dialect.numeric]
    numbers = numbers_of(rows, dialect.separator, dialect.decimal, dialect.numeric)
    unnamed = dialect.names == tuple(map(str, range(count)))
    if unnamed and not words and ACROSS * len(numbers) <= count:
        return {str(place): row for place, row in enumerate(numbers)}, ()
    names = list(dialect.names)
    found: dict[str, Any] = {names[place]: column for place, column in zip(dialect.numeric, numbers.T)}
    if words:
        cells = [cells_of(text, dialect.separator) for text in rows.texts]
        for place in words:
            own = [row[place] for row in cells]
            values, unit = measured(own, dialect.decimal) or (_words(own, rows, place), "")
            if unit and not heading_of(names[place]).unit:
                names[place] = f"{names[place]} [{unit}]"
            found[names[place]] = values
    if lvm is not None and lvm.step > 0.0:
        found[names[0]] = lvm.times(len(rows))
    settings = {name: np.array([value]) for name, value in dialect.settings.items() if name not in found}
    return {**{name: found[name] for name in names}, **settings}, dialect.notes


def dialect_of(lines: list[str], name: str) -> Dialect:
    """The dialect of a table that starts with these lines. Raises InputError; `name` is the file's name in messages."""
    lvm = lvm_head(lines)
    if lvm is not None:
        lines = ["" if number < lvm.lines else line for number, line in enumerate(lines)]
    used = [(number, line) for number, line in enumerate(lines) if content(line)]
    if not used:
        raise InputError(f"{name}: is empty")
    separator, decimal, rows, _ = max(_readings([line for _, line in used]), key=lambda one: one[3])
    if not any(rows):  # no numbers, only names
        separator = max(SEPARATORS, key=lambda one: len(cells_of(used[-1][1], one)))
        head = cells_of(used[-1][1], separator)
        return Dialect(separator, decimal, len(lines), tuple(head), tuple(range(len(head))))
    split = [cells_of(line, separator) for _, line in used]
    place = _first_row(split, rows, decimal)
    cells = split[place]
    lists = {index for row in split[place:] for index, cell in enumerate(row) if list_of(cell)}
    numeric = tuple(
        index
        for index in range(len(cells))
        if number_of(_first_told(split[place:], index), decimal) is not None and index not in lists
    )
    last, settings = without_settings([line for _, line in used[:place]], len(cells), SEPARATORS)
    above = _names_above(split[:last], used[last - 1][1] if last else "", len(cells))
    head = names_of(above, len(cells))
    if head is not None and lvm is not None:
        head = lvm.names(head, len(cells))
    if head is None:
        head = _unnamed(lines[: used[place][0]], separator, split[place:])
    if not head[-1] and (not cells[-1] or len(head) > len(cells)):  # a separator after the last name
        head = head[:-1]
    if len(head) == len(cells) - 1 and not cells[-1]:  # every row ends with a separator
        numeric = numeric[:-1]
    elif len(head) != len(cells):
        line = used[last - 1][0] + 1
        raise InputError(f"{name}: line {line} has {len(head)} columns, the rows have {len(cells)}")
    head, notes = _told_apart(head, used[last - 1][0] + 1 if last else 1)
    settings = {**stated_above(lines[: used[place][0]]), **settings}
    return Dialect(
        separator,
        decimal,
        used[place][0],
        tuple(head),
        numeric,
        tuple(above[-1]) if above else (),
        notes,
        settings,
    )


def _told_apart(head: list[str], line: int) -> tuple[list[str], tuple[str, ...]]:
    """Distinct names of columns: repeated names are numbered before their unit, as in pandas, with a note on each."""
    found: list[str] = []
    notes: list[str] = []
    for name in head:
        number, own = 0, name
        while own in found or (number and own in head):
            number += 1
            own = UNIT_OR_END.sub(rf".{number}\1", name, count=1)
        found.append(own)
        if number:
            notes.append(
                f"line {line} names several columns {name!r}; of these, {own!r} is number {number + 1}"
            )
    return found, tuple(notes)


def _first_told(rows: list[list[str]], place: int) -> str:
    """The first cell of a column that is not missing; empty where all are missing."""
    return next((row[place] for row in rows if len(row) > place and not is_missing(row[place])), "")


def _readings(lines: list[str]) -> Iterator[tuple[str | None, str, list[int], tuple[int, int, int]]]:
    """Possible readings of the lines: separator, decimal mark, the count of numbers in each line (0 where it is no
    row), and a score. The score is the count of numbers that are separated in rows, the number of rows, and the
    count of cells recognised as empty."""
    for separator in SEPARATORS:
        split = [cells_of(line, separator) for line in lines]
        for decimal in (".",) if separator == "," and not any('"' in line for line in lines) else (".", ","):
            count = [sum(_count(cell, decimal) for cell in row) for row in split]
            usual = Counter(len(row) for row, numbers in zip(split, count) if numbers).most_common(1)
            width = usual[0][0] if usual else 0
            rows = [n if len(row) == width else 0 for row, n in zip(split, count)]
            empty = sum(row.count("") for row, n in zip(split, rows) if n)
            yield separator, decimal, rows, (sum(rows), sum(map(bool, rows)), empty)


def _count(cell: str, decimal: str) -> int:
    """Count of numbers in a cell, several for a list; [1] may be a unit."""
    if is_number(cell, decimal) or is_measured(cell, decimal):
        return 1
    found = list_of(cell) or ()
    return len(found) if len(found) > 1 else 0


def _names_above(above: list[list[str]], last: str, count: int) -> list[list[str]]:
    """The lines above the first row, without those that cannot name its `count` columns.

    The last of them may have another separator than the rows. It is a title if it is one cell with every separator.
    It is the rest of a lost row if it holds only numbers.
    """
    if not above or len(above[-1]) == count:
        return above
    if len(above[-1]) > count and len(cells := WIDE_GAP.split(last.strip())) == count:
        return [*above[:-1], cells]
    for separator in SEPARATORS:
        if len(cells := cells_of(last, separator)) == count and len(above[-1]) == 1:
            return [*above[:-1], cells]
    if len(above[-1]) == 1 and count > 1:  # a title, or a line between names and rows
        return [] if any(letter.isalnum() for letter in last) else _names_above(above[:-1], "", count)
    broken = len(above[-1]) < count and all(not cell or is_number(cell, ".") for cell in above[-1])
    return above[:-1] if broken else above


def _unnamed(before: list[str], separator: str | None, rows: list[list[str]]) -> list[str]:
    """Names of columns from a comment before the rows, else their indices; a separator at the end of every row
    makes no column."""
    count = len(rows[0])
    ended = not any(row[-1] for row in rows if len(row) == count)
    filled = count - 1 if ended and count > 1 else count
    return (
        _remark(before, separator, count)
        or _remark(before, separator, filled)
        or [str(number) for number in range(filled)]
    )


def _remark(lines: list[str], separator: str | None, count: int) -> list[str] | None:
    """Names, and units, in the last comment lines with as many entries as there are columns."""
    remarks = [line.strip().lstrip("#% ") for line in lines if line.lstrip()[:1] in COMMENTS]
    told = [_named_cells(line, separator, count) for line in remarks if line]
    while told and len(told[-1]) != count:
        told.pop()
    return names_of(told, count)


def _named_cells(line: str, separator: str | None, count: int) -> list[str]:
    """Cells of a comment line. Where these are not `count`, those of the line after a label such as `Columns:`, with
    another separator where necessary."""
    cells = cells_of(line, separator)
    if len(cells) == count:
        return cells
    label, _, rest = line.partition(":")
    if not rest.strip() or len(label.split()) > LONGEST_LABEL or not label.strip():
        return cells
    fitting = (cells_of(rest.strip(), one) for one in dict.fromkeys((separator, *SEPARATORS)))
    return next((one for one in fitting if count > 1 and len(one) == count and _may_be_names(one)), cells)


def _may_be_names(cells: list[str]) -> bool:
    """Whether cells are distinct and none is a number or empty, unlike the values that a label may have, too."""
    plain = all(cell and not is_number(cell, ".") for cell in cells)
    return plain and len(set(cells)) == len(cells)


def _first_row(rows: list[list[str]], numbers: list[int], decimal: str) -> int:
    """Index of the first line of numbers, skipping a title or line of units that also holds a number.

    Such a line begins with a word where most rows have a number, and has at most as many numbers as words.
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
    """Whether the first filled cell is no number where most of the rows below have one."""
    place = next((place for place, cell in enumerate(row) if cell), 0)
    if number_of(row[place], decimal) is not None:
        return False
    there = [is_number(cells[place], decimal) for cells in below if len(cells) == len(row)]
    return 2 * sum(there) > len(there)


def _words(cells: list[str], rows: Rows, place: int) -> np.ndarray:
    """A text column; lists where its cells are lists, seconds where they are times."""
    found = lists_of(cells, rows, place)
    if found is None:
        found = seconds(cells)
    # fixed-width text would need much more memory
    return np.array(cells, dtype=object) if found is None else found
