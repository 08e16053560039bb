"""Tables in JSON: one object per line, a list of objects, or named lists, also nested (RFC 8259, jsonlines.org)."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rhythmid.record.clock_time import seconds
from rhythmid.record.text_cells import number_of
from rhythmid.record.text_file import opened

LINES = (".jsonl", ".ndjson")
JSON = (".json", *LINES)
UNNAMED = "values"  # name of a list without one


def read_json(path: Path) -> dict[str, Any]:
    """Columns by path: `state.q` where each row is an object that contains others, float64[n, k] where each row
    holds a list.

    A value that some rows lack is NaN there. Values that are neither a list nor in one are left out. Raises
    ValueError where the file is not JSON. An incomplete last line, as from a logger that was switched off, is left
    out.
    """
    with opened(path) as file:
        text = file.read()
    try:
        found = json.loads(text)
    except json.JSONDecodeError:
        lines = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
        if not lines or lines[0][1].strip() in ("[", "{"):
            raise
        found = list(_rows(lines))
    if isinstance(found, Mapping) and not any(isinstance(one, (Mapping, list)) for one in found.values()):
        found = [found]  # a file with one line
    return dict(_lists("", found))


def _rows(lines: Sequence[tuple[int, str]]) -> Iterator[Any]:
    """Content of each line. Raises ValueError with the number of a line that is not JSON, except for an incomplete
    last one."""
    for number, line in lines:
        try:
            yield json.loads(line)
        except json.JSONDecodeError as error:
            if number == lines[-1][0] and number > lines[0][0]:
                return
            raise ValueError(
                f"line {number} is no JSON ({error.msg}); delete what does not belong to it"
            ) from None


def _lists(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Columns of all lists in a value."""
    if isinstance(value, list):
        yield from _columns(name, value)
    elif isinstance(value, Mapping):
        # a list as an object with row numbers as keys
        if len(value) > 1 and all(key.isdecimal() for key in value):
            yield from _columns(name, list(value.values()))
            return
        if (named := _named_columns(value)) is not None:
            yield from ((_path(name, key), column) for key, column in named.items())
            return
        for key, inner in value.items():
            yield from _lists(_path(name, key), inner)


def _named_columns(value: Mapping[str, Any]) -> dict[str, Any] | None:
    """The columns of rows whose names are in a separate list, as pandas writes them; None where there is none."""
    rows = [
        one
        for one in value.values()
        if isinstance(one, list) and one and all(isinstance(row, list) for row in one)
    ]
    heads = [
        one
        for one in value.values()
        if isinstance(one, list) and one and all(isinstance(cell, str) for cell in one)
    ]
    if len(rows) != 1 or len(heads) != 1 or {len(row) for row in rows[0]} != {len(heads[0])}:
        return None
    cells = zip(*rows[0], strict=True)
    return {
        key: column
        for name, own in zip(heads[0], cells, strict=True)
        for key, column in _columns(name, list(own))
    }


def _columns(name: str, rows: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    """Columns from the content of the rows; None marks an empty row."""
    there = [one for one in rows if one is not None]
    if not there:
        return
    if all(isinstance(one, Mapping) for one in there):
        for key in dict.fromkeys(key for one in there for key in one):
            yield from _columns(_path(name, key), [None if one is None else one.get(key) for one in rows])
    elif all(isinstance(one, list) for one in there):
        width = max(map(len, there))
        if all(_is_number(cell) for one in there for cell in one):
            nothing = [None] * width
            cells = [[*(row or []), *nothing][:width] for row in rows]
            yield name or UNNAMED, np.array(cells, dtype=np.float64).reshape(len(rows), width)
            return
        for place in range(width):
            parts = [one[place] if one is not None and place < len(one) else None for one in rows]
            yield from _columns(f"{name or UNNAMED}[{place}]", parts)
    elif all(_is_number(one) for one in there):
        yield name or UNNAMED, np.array(rows, dtype=np.float64)
    elif all(isinstance(one, str) or _is_number(one) for one in there):
        yield name or UNNAMED, _words(["" if one is None else str(one) for one in rows])


def _words(cells: Sequence[str]) -> Any:
    """Numbers written as text, times in seconds, or the texts themselves."""
    numbers = [number_of(cell, ".") for cell in cells]
    if all(number is not None for number in numbers):
        return np.array(numbers, dtype=np.float64)
    found = seconds(list(cells))
    return np.array(cells, dtype=object) if found is None else found


def _is_number(cell: Any) -> bool:
    """Whether a cell is a number, true, false or null."""
    return cell is None or isinstance(cell, (int, float))


def _path(above: str, key: str) -> str:
    return f"{above}.{key}" if above else key
