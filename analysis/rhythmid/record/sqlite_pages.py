"""Reads rows page by page from an sqlite database that sqlite cannot open because its beginning is damaged.

The first page holds the header and the schema; without them sqlite cannot open the file. The rows are in the leaf
pages of its tables. Each row states its own number, length and types (https://sqlite.org/fileformat.html). The
types show to which table it belongs.
"""

import struct
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

Row = tuple[int, list[Any]]  # number and values; the values of an INTEGER PRIMARY KEY are None
PAGE_SIZES = tuple(2**power for power in range(9, 17))  # bytes
LEAF = 0x0D  # first byte of a page with rows of a table
_HEAD = 8  # bytes before the row positions of a leaf page
_FILE_HEAD = 100  # bytes of the first page before the usual page header
_TRIED = 2**20  # bytes from the beginning whose rows are used to find the page size
_MOST_VALUES = 32  # largest number of values in a row; a recording has at most six


class Pages:
    """The leaf pages of a damaged database, in the order of the numbers of their rows."""

    def __init__(self, data: memoryview) -> None:
        self._data = data
        self.size = max(PAGE_SIZES, key=self._readable)

    def rows(self, wanted: Callable[[list[Any]], bool]) -> Iterator[Row]:
        """Rows whose values are `wanted`, each row number once, in order."""
        places = []
        for page in self._leaves(self.size):
            first = next((row for row in self._rows_of(page) if wanted(row[1])), None)
            if first is not None:
                places.append((first[0], page))
        last = 0
        for _, page in sorted(places):
            for number, values in self._rows_of(page):
                if number > last and wanted(values):
                    last = number
                    yield number, values

    def _readable(self, size: int) -> int:
        """Number of rows in the first pages, if pages had this size."""
        self.size = size
        return sum(1 for page in self._leaves(size) if page < _TRIED for _ in self._rows_of(page))

    def _leaves(self, size: int) -> Iterator[int]:
        """Offsets of the pages that start like leaf pages."""
        whole = len(self._data) // size
        kinds = np.frombuffer(self._data[: whole * size], dtype=np.uint8)[::size]
        yield from (np.flatnonzero(kinds == LEAF) * size).tolist()
        if whole and self._data[_FILE_HEAD] == LEAF:
            yield 0

    def _rows_of(self, page: int) -> Iterator[Row]:
        """The complete rows of a leaf page."""
        data = self._data[page : page + self.size]
        head = _FILE_HEAD if page == 0 else 0
        (count,) = struct.unpack_from(">H", data, head + 3)
        first = head + _HEAD
        if first + 2 * count > len(data):
            return
        for at in struct.unpack_from(f">{count}H", data, first):
            try:
                if at >= first + 2 * count:
                    yield self._row(data, at)
            except (ValueError, IndexError, struct.error):
                continue  # this row is damaged

    def _row(self, data: memoryview, at: int) -> Row:
        size, at = _integer(data, at)
        number, at = _integer(data, at)
        return number, _values(self._payload(data, at, size))

    def _payload(self, data: memoryview, at: int, size: int) -> bytes:
        """The content of a row, including its overflow pages. Raises ValueError."""
        if not 0 < size <= len(self._data):
            raise ValueError("a row is longer than the file")
        if size <= self.size - 35:
            if at + size > len(data):
                raise ValueError("a row is longer than its page")
            return bytes(data[at : at + size])
        least = (self.size - 12) * 32 // 255 - 23
        local = least + (size - least) % (self.size - 4)
        local = local if local <= self.size - 35 else least
        parts, left = [bytes(data[at : at + local])], size - local
        (following,) = struct.unpack_from(">I", data, at + local)
        while left > 0:
            begin = (following - 1) * self.size
            if begin < 0 or begin + self.size > len(self._data):
                raise ValueError("a row goes on outside of the file")
            (following,) = struct.unpack_from(">I", self._data, begin)
            parts.append(bytes(self._data[begin + 4 : begin + min(self.size, 4 + left)]))
            left -= self.size - 4
        return b"".join(parts)


def _integer(data: bytes | memoryview, at: int) -> tuple[int, int]:
    """An integer of variable length, and the position of its end."""
    value = 0
    for place in range(8):
        byte = data[at + place]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + place + 1
    return value << 8 | data[at + 8], at + 9


_LENGTHS = (0, 1, 2, 3, 4, 6, 8, 8, 0, 0)  # bytes of values by their type number


def _values(content: bytes) -> list[Any]:
    """The values of a row. Raises ValueError where its lengths are inconsistent."""
    head, at = _integer(content, 0)
    if not at < head <= len(content):
        raise ValueError("the head of a row is longer than the row")
    kinds: list[int] = []
    while at < head:
        kind, at = _integer(content, at)
        kinds.append(kind)
    lengths = [_LENGTHS[kind] if kind < 10 else (kind - 12) // 2 for kind in kinds]
    if (
        at != head
        or len(kinds) > _MOST_VALUES
        or 10 in kinds
        or 11 in kinds
        or head + sum(lengths) != len(content)
    ):
        raise ValueError("the lengths of a row do not agree")
    found: list[Any] = []
    for kind, length in zip(kinds, lengths, strict=True):
        found.append(_value(kind, content[at : at + length]))
        at += length
    return found


def _value(kind: int, content: bytes) -> object:
    if kind == 0:
        return None
    if kind < 7:
        return int.from_bytes(content, "big", signed=True)
    if kind == 7:
        return struct.unpack(">d", content)[0]
    if kind < 10:
        return kind - 8
    return content if kind % 2 == 0 else content.decode("utf-8", "strict")
