"""Splits lines of a text table into cells, and converts cells to numbers."""

import csv
import re

import numpy as np

COMMENTS = ("#", "%")
EMPTY = " \t\r\n;,\"'\0"  # characters of a line of empty cells, and the end of a file whose writer lost power
# notations for a missing number
MISSING = frozenset(
    "nan n/a na #n/a null none undefined - -- --- -nan -nan(ind) nan(ind) 1.#qnan -1.#ind #num! #div/0!".split()
)
INFINITE = {"∞": np.inf, "+∞": np.inf, "-∞": -np.inf}  # out of range, as an oscilloscope writes it
HEXADECIMAL = re.compile(r"0[xX][0-9a-fA-F]+")  # of a register or a counter
THOUSANDS = re.compile(
    r"[+-]?\d{1,3}(?:,\d{3})+\.\d+"
)  # 5,000.00; without decimals it could be a decimal comma


def content(line: str) -> bool:
    """Whether a line has content other than a comment or empty cells, which spreadsheets append by the thousand."""
    return bool(line.strip(EMPTY)) and line.lstrip()[0] not in COMMENTS


def own(line: str, separator: str | None) -> str:
    """A line without the commas of empty cells that a spreadsheet has appended after taking the line for one cell."""
    line = line.strip(" \r\n")
    return line if separator == "," else line.rstrip(",")


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line, without quotes and surrounding spaces."""
    if separator is None:
        return next(csv.reader([" ".join(line.split())], delimiter=" ", skipinitialspace=True), [])
    row = next(csv.reader([own(line, separator)], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip().strip("'").strip() for cell in row]


def number_of(cell: str, decimal: str) -> float | None:
    """A cell's value; None where it is no number. An empty cell or one marked as missing gives NaN, so that a
    message can give its position."""
    cell = cell.strip().strip("\"'").replace("−", "-")
    if is_missing(cell):
        return np.nan
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    elif THOUSANDS.fullmatch(cell):
        cell = cell.replace(",", "")
    try:
        return float(int(cell, 16)) if HEXADECIMAL.fullmatch(cell) else float(cell)
    except ValueError:
        return INFINITE.get(cell)


def is_missing(cell: str) -> bool:
    """Whether a cell is empty or marked as missing."""
    cell = cell.strip().strip("\"'")
    return not cell or cell.lower() in MISSING


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number, and is neither empty nor marked as missing."""
    found = number_of(cell, decimal)
    return found is not None and (found == found or cell.strip().strip("\"'").lower() == "nan")
