"""A MATLAB `timeseries` in a MAT file of version 5, written byte by byte as MATLAB writes objects."""

import io
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from rhythmid.record.matlab_class import OBJECT

Fields = Sequence[tuple[str, int]]  # properties of an object, with the cells that hold them

MATRIX, WORDS, WHOLE, TEXT = 14, 6, 5, 1  # types of elements
STRUCT, OPAQUE = 2, 17  # classes of matrices
NAMES = ("timeseries", "timemetadata", "Name", "TimeInfo", "Data_", "Length", "Start_", "Increment_", "Time_")
EVEN: Fields = (("Length", 3), ("Start_", 4), ("Increment_", 5))
LISTED: Fields = (("Time_", 3),)


def timeseries_file(
    signal: NDArray[np.float64], time: Fields, values: Sequence[Any], version: int = 4
) -> bytes:
    """The file with `signal` (n, 1) as the timeseries `run` named "Motor speed"; `time` are the properties of its times, `values`
    their cells."""
    listed = [
        np.frombuffer(_tables(version, time), dtype=np.uint8)[:, None], np.zeros((1, 0)), "Motor speed", _reference(2), signal, *values,
    ]  # fmt: skip
    cells = np.empty((len(listed), 1), dtype=object)
    cells[:, 0] = listed
    field = struct.pack("<2HI", WHOLE, 4, 32) + _element(TEXT, b"MCOS".ljust(32, b"\0"))
    size = _element(WHOLE, struct.pack("<2i", 1, 1)) + _element(TEXT, b"")
    wrapper = _opaque("", "FileWrapper__", _plain(cells))
    whole = _element(MATRIX, _head(STRUCT) + size + field + wrapper)
    file = io.BytesIO()
    savemat(file, {"x": np.frombuffer(b"\x00\x01IM\0\0\0\0" + whole, dtype=np.uint8)[None, :]})
    unnamed = file.getvalue().replace(
        struct.pack("<2H4s", TEXT, 1, b"x"), struct.pack("<2H4s", TEXT, 0, b""), 1
    )
    return unnamed[:128] + _opaque("run", "timeseries", _plain(_reference(1))) + unnamed[128:]


def _tables(version: int, time: Fields) -> bytes:
    """The first cell: two classes, a timeseries with its times in the object 2, and `time`, the properties of the latter."""
    row = {name: place + 1 for place, name in enumerate(NAMES)}
    names = b"".join(one.encode() + b"\0" for one in NAMES)
    names += b"\0" * (-len(names) % 8)
    own = [0, 0]
    for block in ((("Name", 0), ("TimeInfo", 1), ("Data_", 2)), time):
        own += [len(block), *(word for name, value in block for word in (row[name], 1, value))]
        own += [0] * (len(own) % 2)
    parts = (
        [0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0],
        [0, 0],
        [*[0] * 6, 1, 0, 0, 0, 1, 1, 2, 0, 0, 0, 2, 2],
        own,
        [0, 0],
    )
    ends = np.cumsum([40 + len(names), *(4 * len(part) for part in parts)])
    words = b"".join(struct.pack(f"<{len(part)}I", *part) for part in parts)
    return struct.pack("<8I", version, len(NAMES), *ends) + b"\0" * 8 + names + words


def _element(kind: int, content: bytes) -> bytes:
    return struct.pack("<2I", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def _head(kind: int) -> bytes:
    return _element(WORDS, struct.pack("<2I", kind, 0))


def _opaque(name: str, of_class: str, content: bytes) -> bytes:
    texts = b"".join(_element(TEXT, one.encode()) for one in (name, "MCOS", of_class))
    return _element(MATRIX, _head(OPAQUE) + texts + content)


def _plain(value: Any) -> bytes:
    """The element of an array, with a name that MATLAB leaves out."""
    file = io.BytesIO()
    savemat(file, {"x": value})
    return file.getvalue()[128:]


def _reference(number: int) -> NDArray[np.uint32]:
    return np.array([[OBJECT], [2], [1], [1], [number], [1]], dtype=np.uint32)
