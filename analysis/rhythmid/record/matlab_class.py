"""Properties of MATLAB's objects in MAT files of version 5, such as the times and values of a `timeseries`.

MATLAB keeps all objects of a file in its subsystem data, a matrix `FileWrapper__` of cells. The first cell holds tables of 32-bit
words; the cells after the second one hold the values of properties. MathWorks does not document it. Others described the layout
(M. Bauman, "The MAT-file's class definition format", nbviewer.org/gist/mbauman/9121961; github.com/foreverallama/mat-io):

| place | meaning |
| --- | --- |
| word 0 | version of the layout, 2 to 4 |
| word 1 | number of names |
| words 2 to 7 | offsets [bytes] of classes, properties kept as texts, objects, properties, and of two other tables |
| from byte 40 | the names, each ended by a zero |
"""

import io
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
# first word of an array that refers to an object; the last two are its number and its class
OBJECT = 0xDD000000
HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"  # of a file with little-endian numbers
SUBSYSTEM = "__function_workspace__"  # name under which scipy keeps the subsystem data
NAMES = 40  # offset of the names [bytes]
KNOWN = (2, 3, 4)  # versions of the layout
FIRST_VALUE = 2  # cell of the value number 0
DEEPEST = 4  # objects within objects that are followed
TIMES = ("Time_", "Length", "Start_", "Increment_")  # properties of a `timemetadata`


@dataclass(frozen=True)
class Objects:
    """The objects of a file.

    Parameters
    ----------
    classes : the class of each object, by its number from 1.
    properties : name, kind (0 a name, 1 a value, 2 a logical) and value of each property of each object.
    cells : the values.
    names : texts to which properties of the kind 0 refer.
    """

    classes: Mapping[int, str]
    properties: Mapping[int, tuple[tuple[str, int, int], ...]]
    cells: Array
    names: tuple[str, ...]

    def of(self, number: int, depth: int = 0) -> dict[str, Any]:
        """The properties of an object by name; those that are objects as mappings."""
        found: dict[str, Any] = {}
        for name, kind, value in self.properties.get(number, ()):
            if kind == 0:
                found[name] = self.names[value - 1]
            elif kind == 1:
                cell = self.cells[FIRST_VALUE + value]
                inner = number_of_object(cell)
                found[name] = cell if inner is None or depth >= DEEPEST else self.of(inner, depth + 1)
            else:
                found[name] = bool(value)
        return found


def number_of_object(value: Any) -> int | None:
    """The number of the object to which an array of words refers; None where it refers to none, or to several."""
    words = np.ravel(np.asarray(value))
    if words.dtype != np.uint32 or len(words) != 6 or words[0] != OBJECT:
        return None
    return int(words[4])


def objects_of(workspace: Array) -> Objects:
    """The objects in the subsystem data of a file, uint8[1, bytes]. Raises ValueError where its layout is another one."""
    from scipy.io.matlab._mio5 import MatFile5Reader

    reader = MatFile5Reader(io.BytesIO(HEADER + np.ravel(workspace).tobytes()[8:]))
    reader.initialize_read()
    reader.read_file_header()
    header, _ = reader.read_var_header()
    whole = reader.read_var_array(header, process=False)
    wrapper = whole["MCOS"][0, 0]
    cells = np.ravel(wrapper["arr"][0] if wrapper.dtype.names else wrapper)
    return decoded(np.ravel(cells[0]).tobytes(), cells)


def decoded(tables: bytes, cells: Array) -> Objects:
    """The objects that the tables in the first cell describe."""
    version, count, *ends = struct.unpack_from("<8I", tables)
    if version not in KNOWN:
        raise ValueError(f"its objects have the layout {version}, which is unknown")
    names = tuple(one.decode() for one in tables[NAMES : ends[0]].split(b"\x00")[:count])
    words = [np.frombuffer(tables[begin:end], dtype="<u4").astype(int) for begin, end in zip(ends, ends[1:])]
    classes, texts, objects, own = words[:4]
    kinds = [names[name - 1] if name else "" for name in classes.reshape(-1, 4)[:, 1]]
    lists = [_blocks(texts, names), _blocks(own, names)]
    found: dict[int, tuple[tuple[str, int, int], ...]] = {}
    of_class: dict[int, str] = {}
    for number, row in enumerate(objects.reshape(-1, 6)):
        of_class[number] = kinds[row[0]] if row[0] < len(kinds) else ""
        of_object = (lists[part][row[3 + part]] for part in (0, 1) if 0 < row[3 + part] < len(lists[part]))
        found[number] = tuple(one for block in of_object for one in block)
    return Objects(of_class, found, cells, names)


def _blocks(words: NDArray[np.int_], names: tuple[str, ...]) -> list[tuple[tuple[str, int, int], ...]]:
    """Lists of properties: a count, then name, kind and value of each, padded to an even number of words."""
    found: list[tuple[tuple[str, int, int], ...]] = []
    place = 0
    while place < len(words):
        count = int(words[place])
        rows = words[place + 1 : place + 1 + 3 * count].reshape(-1, 3)
        found.append(tuple((names[name - 1], int(kind), int(value)) for name, kind, value in rows))
        place += 1 + 3 * count
        place += place % 2
    return found


def signals_of(path: Path, found: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Name, times and values of each `timeseries` of a file by its variable's name; `found` is what scipy read of it.

    Empty where the objects have a layout that is not known.
    """
    try:
        return _signals(path, objects_of(found[SUBSYSTEM])) if SUBSYSTEM in found else {}
    except (ValueError, IndexError, KeyError, TypeError, struct.error):
        return {}


def _signals(path: Path, objects: Objects) -> dict[str, dict[str, Any]]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque, varmats_from_mat

    told: dict[str, dict[str, Any]] = {}
    with path.open("rb") as file:
        for _, alone in varmats_from_mat(file):  # read together, all objects have one name
            for one in loadmat(alone).values():
                if isinstance(one, MatlabOpaque) and (number := number_of_object(one["arr"][0])) is not None:
                    name = np.ravel(one["s0"])[0].decode(errors="replace")
                    told[name] = signal_of(objects.classes.get(number, ""), objects.of(number))
    return {name: signal for name, signal in told.items() if signal}


def signal_of(of_class: str, properties: Mapping[str, Any]) -> dict[str, Any]:
    """Name, times [s] and values of a `timeseries`; empty for another class, and where it holds no numbers with times."""
    data = np.asarray(properties.get("Data_", properties.get("Data", "")))
    about = properties.get("TimeInfo")
    if of_class != "timeseries" or data.dtype.kind not in "fiub":
        return {}
    time = np.ravel(np.asarray(properties.get("Time_", properties.get("Time", ()))))
    if not time.size and isinstance(about, Mapping):
        time = _told_times(about, max(data.shape, default=0))
    values = _by_time(data, len(time))
    if values is None:
        return {}
    return {"Name": "".join(np.ravel(properties.get("Name", "")).astype(str)), "Time": time, "Data": values}


def _told_times(about: Mapping[str, Any], most: int) -> Array:
    """The times of a `timemetadata`: listed, or at most `most` even ones from the first by a step; none where neither is told."""
    listed, length, first, step = (np.ravel(np.asarray(about.get(name, ()))) for name in TIMES)
    if listed.size:
        return listed
    if not (length.size == first.size == step.size == 1 and np.isfinite(step).all() and length[0] <= most):
        return np.zeros(0)
    return first[0] + step[0] * np.arange(int(length[0]))


def _by_time(values: Array, count: int) -> Array | None:
    """The values with one row per time, whose number may be the first or the last dimension; None where it is neither."""
    if count and values.shape[:1] == (count,):
        return values.reshape(count, -1)
    return values.reshape(-1, count).T if count and values.shape[-1:] == (count,) else None
