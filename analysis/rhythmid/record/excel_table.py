"""Workbooks (.xlsx, .xlsm) as text tables: the first sheet with numbers, its cells as a text file would hold them."""

import datetime
import io
import re
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rhythmid.errors import InputError
from rhythmid.record.compression import largest
from rhythmid.record.text_cells import is_number
from rhythmid.record.text_table import LOOKED_AT, table_of

EXCEL = (".xlsx", ".xlsm")
STYLES = "xl/styles.xml"
EMPTY_FILL = re.compile(rb"<fill\s*/>|<fill>\s*</fill>")
FILL = b"<fill><patternFill/></fill>"
SEPARATOR = "\t"
WIDEST_SHEET = 1024  # columns: a cell beyond is a slip, and empty cells up to it would fill the memory
FEWEST_ROWS = 2  # rows with numbers of a sheet that holds a recording


def read_excel(path: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Columns of a workbook by name as of `text_table`, and messages, one line each. Formulas have the values with which
    they were saved.

    Raises InputError where openpyxl is not installed, or no sheet holds numbers; ValueError where the file is damaged.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise InputError(
            f"{path}: reading a workbook needs openpyxl: pip install openpyxl, or save the table as .csv"
        ) from None
    if not path.exists():
        raise FileNotFoundError
    _check_size(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of styles and extensions that hold no numbers
        book = load_workbook(_with_fills(path), read_only=True, data_only=True)
        try:
            for place, sheet in enumerate(book.worksheets):
                lines = _lines(path, sheet)
                if lines is None:
                    continue
                others = [one.title for number, one in enumerate(book.worksheets) if number != place]
                columns, notes = table_of(lines, f"{path}, sheet {sheet.title!r}")
                listed = ", ".join(map(repr, others))
                told = (f"the sheet {sheet.title!r} is read, and not {listed}",) if others else ()
                return columns, (*told, *notes)
        finally:
            book.close()
    raise InputError(
        f"{path}: no sheet holds a table of numbers; formulas have none until Excel has saved them"
    )


def _check_size(path: Path) -> None:
    """Raise InputError where the archive claims to hold more bytes than a table can; ValueError where it is none."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except zipfile.BadZipFile:
        raise ValueError("it is no workbook, or its end is missing") from None
    _refuse_large(path, size)


def _with_fills(path: Path) -> Path | io.BytesIO:
    """The workbook without empty fills of cells, as LabVIEW writes them: Excel reads these, and openpyxl does not."""
    with zipfile.ZipFile(path) as archive:
        if STYLES not in archive.namelist() or not EMPTY_FILL.search(archive.read(STYLES)):
            return path
        copy = io.BytesIO()
        with zipfile.ZipFile(copy, "w", zipfile.ZIP_DEFLATED) as made:
            for name in archive.namelist():
                content = archive.read(name)
                made.writestr(name, EMPTY_FILL.sub(FILL, content) if name == STYLES else content)
    copy.seek(0)
    return copy


def _refuse_large(path: Path, size: int) -> None:
    packed = path.stat().st_size
    if size > largest(packed):
        raise InputError(f"{path}: claims to hold {size} bytes in {packed}: such tables are not read")


def _lines(path: Path, sheet: Any) -> list[str] | None:
    """The rows of a sheet as lines, without empty rows and columns; None where it holds no table of numbers."""
    sheet.reset_dimensions()  # other programs state wrong ones
    rows: list[dict[int, str]] = []
    used, size, numeric = set[int](), 0, 0
    for row in sheet.iter_rows(max_col=WIDEST_SHEET, values_only=True):
        cells = {place: text for place, value in enumerate(row) if (text := _text(value))}
        if not cells:
            continue
        rows.append(cells)
        used |= cells.keys()
        numeric += any(isinstance(value, (int, float)) for value in row)
        size += sum(map(len, cells.values()))
        _refuse_large(path, max(size, len(rows) * len(used)))
    return list(_joined(rows, sorted(used))) if numeric >= FEWEST_ROWS else None


def _joined(rows: list[dict[int, str]], places: list[int]) -> Iterator[str]:
    """Lines of all columns; above the names, and of titles, only as far as they are filled, as in a text file."""
    heads = (
        number
        for number, cells in enumerate(rows[:LOOKED_AT])
        if len(cells) == len(places) and _are_names(cells)
    )
    head = next(heads, 0)
    for number, cells in enumerate(rows):
        line = SEPARATOR.join(cells.get(place, "") for place in places)
        title = len(cells) == 1 and _are_names(cells)
        yield (line.strip(SEPARATOR) if number < head or title else line) + "\n"


def _are_names(cells: dict[int, str]) -> bool:
    return all(not is_number(cell, ".") for cell in cells.values())


def _text(value: Any) -> str:
    """A cell as a text file would hold it; empty where it holds nothing."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    if isinstance(value, (datetime.datetime, datetime.date, datetime.time)):
        return str(value)
    text = " ".join(str(value).replace('"', "'").split())
    return "nan" if text.startswith("#") and text.endswith(("!", "?", "A")) else text
