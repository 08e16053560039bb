"""Lines of a text table taken apart into cells, and cells into numbers."""

import csv
import re

import numpy as np

COMMENTS = ("#", "%")
EMPTY = " \t\r\n;,\"'\0"  # what a line of empty cells is made of, and what a file ends with whose writer lost its power
# what programs write in place of a number that is missing
MISSING = frozenset(
    "nan n/a na #n/a null none undefined - -- --- -nan -nan(ind) nan(ind) 1.#qnan -1.#ind #num! #div/0!".split()
)
INFINITE = {"∞": np.inf, "+∞": np.inf, "-∞": -np.inf}  # beyond its range, as an oscilloscope writes it
HEXADECIMAL = re.compile(r"0[xX][0-9a-fA-F]+")  # of a register or a counter
THOUSANDS = re.compile(
    r"[+-]?\d{1,3}(?:,\d{3})+\.\d+"
)  # 5,000.00; without decimals it could be a decimal comma


def content(line: str) -> bool:
    """Whether a line is anything but a comment or empty cells, of which spreadsheets leave thousands below a table."""
    return bool(line.strip(EMPTY)) and line.lstrip()[0] not in COMMENTS


def own(line: str, separator: str | None) -> str:
    """A line without what a spreadsheet has appended that took it for one cell: the commas of empty cells."""
    line = line.strip(" \r\n")
    return line if separator == "," else line.rstrip(",")


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line, without quotes and the spaces around them."""
    if separator is None:
        return next(csv.reader([" ".join(line.split())], delimiter=" ", skipinitialspace=True), [])
    row = next(csv.reader([own(line, separator)], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip().strip("'").strip() for cell in row]


def number_of(cell: str, decimal: str) -> float | None:
    """A cell's value, None where it is no number; NaN where it is empty or says that it is missing, so that a complaint can name where."""
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
    """Whether a cell is empty, or holds what stands for a number that is missing."""
    cell = cell.strip().strip("\"'")
    return not cell or cell.lower() in MISSING


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number, not nothing and no word for a missing one."""
    found = number_of(cell, decimal)
    return found is not None and (found == found or cell.strip().strip("\"'").lower() == "nan")
