"""Logged signals of Simulink in MAT files of version 7.3: a `Simulink.SimulationData.Dataset` whose values are in a stream.

MathWorks does not document the layout; it is read from such files as the names in them tell:

| place | meaning |
| --- | --- |
| group in `#refs#` with `DataR2` and `SignalAttributes` | one `timeseries` with its `Name` |
| `SignalAttributes/ClassName`, `Dimension` | type of a value, and values of a sample |
| `DataR2` | number of the group in `#sigstream#` whose `#data#` are the bytes of all samples |
| `CompressedTime` | first time [s], step [s] and number of samples |
| `Time`, `TimeR2` | the times themselves [s], or the number of their group in `#sigstream#` |
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
REFERENCES, STREAM, DATA = "#refs#", "#sigstream#", "#data#"
# NumPy's types of MATLAB's classes of numbers, as MATLAB writes them on every computer
TYPES = {"double": "<f8", "single": "<f4", "logical": "u1", "boolean": "u1"} | {
    f"{sign}int{8 * size}": f"<{sign or 'i'}{size}" for sign in ("", "u") for size in (1, 2, 4, 8)
}
EMPTY = "MATLAB_empty"  # attribute of a dataset that stands for an array without values


def logged_signals(file: Any, most: int) -> dict[str, Array]:
    """Times [s] and values (n,) or (n, k) of each logged signal, as `speed.Time` and `speed.speed`; none where a file
    holds no stream. A signal without a name, or with that of another one, is called by its place, `data[1]`.

    Raises ValueError where they are more than `most` bytes. A signal that does not fit its own description is left out.
    """
    if REFERENCES not in file or STREAM not in file:
        return {}
    found: dict[str, Array] = {}
    for one in _logged(file[REFERENCES]):
        try:
            time, values = _signal(one, file[STREAM], most)
        except (KeyError, IndexError, TypeError):
            continue
        most -= time.nbytes + values.nbytes
        name = _text(one["Name"])
        place = name if name and f"{name}.Time" not in found else f"data[{len(found) // 2}]"
        found |= {f"{place}.Time": time, f"{place}.{name or 'Data'}": values}
    return found


def _logged(references: Any) -> Iterator[Any]:
    """The groups that describe a logged signal, in the order of their values."""
    groups: list[Any] = []

    def visit(name: str, one: Any) -> None:
        if hasattr(one, "keys") and {"DataR2", "SignalAttributes", "Name"} <= set(one):
            groups.append(one)

    references.visititems(visit)
    return iter(sorted(groups, key=lambda one: float(np.ravel(one["DataR2"][()])[0])))


def _signal(one: Any, stream: Any, most: int) -> tuple[Array, Array]:
    """Times and values. Raises KeyError where a part is missing, or the values do not belong to the times."""
    about = one["SignalAttributes"]
    width = math.prod(int(size) for size in np.ravel(about["Dimension"][()]))
    values = _stream(stream, one["DataR2"], TYPES[_text(about["ClassName"])], most)
    time = _times(one, stream, most)
    if width < 1 or len(values) != len(time) * width:
        raise KeyError("values")
    return time, values if width == 1 else values.reshape(len(time), width)


def _times(one: Any, stream: Any, most: int) -> Array:
    if not one["CompressedTime"].attrs.get(EMPTY):
        first, step, count = np.ravel(one["CompressedTime"][()])
        if not (np.isfinite([first, step, count]).all() and 0 <= 8 * count <= most):
            raise ValueError(f"claims to hold more than {most} bytes")
        return first + step * np.arange(int(count))
    if not one["Time"].attrs.get(EMPTY):
        return np.ravel(one["Time"][()]).astype(np.float64)
    return _stream(stream, one["TimeR2"], TYPES["double"], most)


def _stream(stream: Any, number: Any, of_type: str, most: int) -> Array:
    """The numbers in the group of the stream to which `number` refers."""
    data = stream[str(int(np.ravel(number[()])[0]))][DATA]
    if data.nbytes > most:
        raise ValueError(f"claims to hold more than {most} bytes")
    return np.frombuffer(np.ravel(data[()]).tobytes(), dtype=of_type)


def _text(one: Any) -> str:
    """The text of a dataset of characters; empty where it has none."""
    return "" if one.attrs.get(EMPTY) else "".join(map(chr, np.ravel(one[()]))).strip("\x00 ")
