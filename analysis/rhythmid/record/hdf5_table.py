"""Arrays of an HDF5 file by path, including MATLAB files of version 7.3 (https://docs.hdfgroup.org)."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.compression import largest
from rhythmid.record.matlab_objects import complaint_of_objects
from rhythmid.record.own_process import arrays_in_own_process
from rhythmid.record.simulink_stream import logged_signals

SIGNATURE = b"\x89HDF\r\n\x1a\n"
STARTS = (0, 512)  # offsets at which HDF5 may begin: MATLAB writes its own header first
OF_MATLAB = "MATLAB_class"  # attribute with MATLAB's class of a dataset
NUMBERS = "fiub"  # kinds of numeric data types
# the same for an object, whose dataset holds only a reference and no numbers
OF_OBJECT = "MATLAB_object_decode"
REFERENCES = "#"  # first character of the groups to which MATLAB's structs and cells refer
DEEPEST = 4  # nesting depth of structs and cells that are read


def is_hdf5(path: Path) -> bool:
    """Whether a file holds HDF5, whatever its name is. Raises OSError where it cannot be opened."""
    with path.open("rb") as file:
        return any(file.seek(start) == start and file.read(len(SIGNATURE)) == SIGNATURE for start in STARTS)


def read_hdf5(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of numbers with one or two dimensions, named `group.name` within groups.

    MATLAB's struct arrays and cells refer to groups of the same file; their arrays are named `runs[0].name`.
    References to other files are not followed, and texts are left out. Raises InputError where h5py is not
    installed, or where the file is damaged or claims more data than its size allows.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"{path}: reading HDF5 needs h5py: pip install h5py, or in MATLAB  save(…, '-v7')"
        ) from None

    def read() -> dict[str, NDArray[Any]]:
        reader = _Reader(largest(path.stat().st_size))
        with h5py.File(path, "r") as file:
            reader.take_all("", file)
            reader.found |= logged_signals(file, reader.left)
        if reader.objects and not reader.found:
            raise ValueError(complaint_of_objects(reader.objects))
        return reader.found

    return dict(arrays_in_own_process(read, f"{path}: cannot be read as a table"))


@dataclass
class _Reader:
    """Collects arrays by path, at most `most` bytes in all, and the classes of MATLAB's objects."""

    most: int
    left: int = field(init=False)
    found: dict[str, NDArray[Any]] = field(default_factory=dict)
    objects: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.left = self.most

    def take_all(self, above: str, group: Any, depth: int = 0) -> None:
        """Read a group without following links to other files."""

        def visit(name: str, one: Any) -> None:
            if not name.startswith(REFERENCES):
                self.take(f"{above}{name.replace('/', '.')}", one, depth)

        group.visititems(visit)

    def take(self, name: str, one: Any, depth: int) -> None:
        """Read a dataset of numbers, or the target of each reference in it."""
        import h5py

        if not isinstance(one, h5py.Dataset) or one.external or one.is_virtual:
            return
        if OF_OBJECT in one.attrs:
            self.objects[name] = bytes(one.attrs.get(OF_MATLAB, b"")).decode(errors="replace")
            return
        of_matlab, refers = one.attrs.get(OF_MATLAB), h5py.check_ref_dtype(one.dtype) is h5py.Reference
        is_number = one.dtype.kind in NUMBERS and one.ndim in (1, 2) and of_matlab != b"char"
        if not refers and not is_number:
            return
        self.left -= one.nbytes
        if self.left < 0:
            raise ValueError(f"claims to hold more than {self.most} bytes")
        values = np.asarray(one[()])
        if is_number:
            self.found[name] = values if of_matlab is None else values.T  # MATLAB stores columns first
        elif depth < DEEPEST:
            for number, reference in enumerate(values.ravel()):
                if reference:
                    self.take_element(name, number, of_matlab == b"cell", one.file[reference], depth + 1)

    def take_element(self, name: str, number: int, of_cell: bool, one: Any, depth: int) -> None:
        """Read an element of a cell, or the field `name` of an element of a struct array."""
        above, _, last = name.rpartition(".")
        path = f"{name}[{number}]" if of_cell or not above else f"{above}[{number}].{last}"
        if hasattr(one, "visititems"):
            self.take_all(f"{path}.", one, depth)
        else:
            self.take(path, one, depth)
