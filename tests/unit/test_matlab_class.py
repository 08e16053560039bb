"""MATLAB's `timeseries` in MAT files of version 5, written here byte by byte as MATLAB writes them."""

import io
import struct

import numpy as np
import pytest
from scipy.io import savemat

from rhythmid.errors import InputError
from rhythmid.record.matlab_class import OBJECT
from rhythmid.record.table import Table

MATRIX, WORDS, WHOLE, TEXT = 14, 6, 5, 1  # types of elements
STRUCT, OPAQUE = 2, 17  # classes of matrices
COUNT = 50
SPEED = np.linspace(0.0, 3.0, COUNT)[:, None]
NAMES = ("timeseries", "timemetadata", "Name", "TimeInfo", "Data_", "Length", "Start_", "Increment_", "Time_")


def element(kind, content):
    return struct.pack("<2I", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def head(kind):
    return element(WORDS, struct.pack("<2I", kind, 0))


def opaque(name, of_class, content):
    texts = b"".join(element(TEXT, one.encode()) for one in (name, "MCOS", of_class))
    return element(MATRIX, head(OPAQUE) + texts + content)


def plain(value):
    """The element of an array, with a name that MATLAB leaves out."""
    file = io.BytesIO()
    savemat(file, {"x": value})
    return file.getvalue()[128:]


def reference(number):
    return np.array([[OBJECT], [2], [1], [1], [number], [1]], dtype=np.uint32)


def tables(version, time):
    """The first cell: two classes, a timeseries with its times in the object 2, and `time`, the properties of the latter."""
    row = {name: place + 1 for place, name in enumerate(NAMES)}
    names = b"".join(one.encode() + b"\0" for one in NAMES)
    names += b"\0" * (-len(names) % 8)
    blocks = ((("Name", 0), ("TimeInfo", 1), ("Data_", 2)), time)
    own = [0, 0]
    for block in blocks:
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


def write(path, version, time, values):
    listed = [
        np.frombuffer(tables(version, time), dtype=np.uint8)[:, None],
        np.zeros((1, 0)),
        "Motor speed",
        reference(2),
        SPEED,
        *values,
    ]
    cells = np.empty((len(listed), 1), dtype=object)
    cells[:, 0] = listed
    wrapper = opaque("", "FileWrapper__", plain(cells))
    field = struct.pack("<2HI", WHOLE, 4, 32) + element(TEXT, b"MCOS".ljust(32, b"\0"))
    whole = element(
        MATRIX, head(STRUCT) + element(WHOLE, struct.pack("<2i", 1, 1)) + element(TEXT, b"") + field + wrapper
    )
    space = np.frombuffer(b"\x00\x01IM\0\0\0\0" + whole, dtype=np.uint8)[None, :]
    file = io.BytesIO()
    savemat(file, {"x": space})
    unnamed = file.getvalue().replace(
        struct.pack("<2H4s", TEXT, 1, b"x"), struct.pack("<2H4s", TEXT, 0, b""), 1
    )
    path.write_bytes(unnamed[:128] + opaque("run", "timeseries", plain(reference(1))) + unnamed[128:])
    return path


EVEN = (("Length", 3), ("Start_", 4), ("Increment_", 5))
LISTED = (("Time_", 3),)


@pytest.mark.parametrize(
    ("time", "values", "expected"),
    [
        (EVEN, (float(COUNT), 2.0, 0.1), 2.0 + 0.1 * np.arange(COUNT)),
        (LISTED, (np.arange(COUNT)[:, None] ** 1.5,), np.arange(COUNT) ** 1.5),
    ],
    ids=["even", "listed"],
)
def test_a_timeseries_is_read_with_its_times_and_its_name(tmp_path, time, values, expected):
    table = Table.load(write(tmp_path / "run.mat", 4, time, values))
    np.testing.assert_allclose(table.column("run.Time"), expected)
    np.testing.assert_allclose(table.column("run.Motor speed"), SPEED[:, 0])


@pytest.mark.parametrize(
    ("version", "length"), [(9, float(COUNT)), (4, 1e15)], ids=["unknown layout", "more times than values"]
)
def test_a_timeseries_that_cannot_be_read_is_refused_with_the_command_that_writes_it(
    tmp_path, version, length
):
    path = write(tmp_path / "run.mat", version, EVEN, (length, 0.0, 0.1))
    with pytest.raises(InputError, match=r"timeseries2timetable\(run\)"):
        Table.load(path)
