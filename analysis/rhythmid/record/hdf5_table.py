"""Arrays of an HDF5 file by the path to them, MATLAB's own of version 7.3 among them (https://docs.hdfgroup.org)."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.compression import largest
from rhythmid.record.matlab_objects import complaint_of_objects
from rhythmid.record.own_process import arrays_in_own_process

SIGNATURE = b"\x89HDF\r\n\x1a\n"
STARTS = (0, 512)  # bytes in front of it that are looked behind: MATLAB writes a header of its own there
OF_MATLAB = "MATLAB_class"  # attribute by which MATLAB says what a dataset is
NUMBERS = "fiub"  # kinds of data types
OF_OBJECT = "MATLAB_object_decode"  # the same of an object, of which the dataset holds where it is kept, and no number of it
REFERENCES = "#"  # with which MATLAB begins the names of the groups to which its structs and cells refer
DEEPEST = 4  # structs and cells within one another that are looked into


def is_hdf5(path: Path) -> bool:
    """Whether a file holds HDF5, whatever it is called. Raises OSError where it cannot be opened."""
    with path.open("rb") as file:
        return any(file.seek(start) == start and file.read(len(SIGNATURE)) == SIGNATURE for start in STARTS)


def read_hdf5(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of numbers with one or two dimensions, `group.name` for those within groups.

    Of MATLAB's struct arrays and cells, which refer to groups of the same file, it is `runs[0].name`. What refers to other files is
    not followed, and texts are left out. Raises InputError where h5py is not installed, or the file is damaged or claims to hold more
    than its size allows.
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
        if reader.objects and not reader.found:
            raise ValueError(complaint_of_objects(reader.objects))
        return reader.found

    return dict(arrays_in_own_process(read, f"{path}: cannot be read as a table"))


@dataclass
class _Reader:
    """Collects arrays by the path to them, of no more than `most` bytes, and the classes of MATLAB's objects."""

    most: int
    left: int = field(init=False)
    found: dict[str, NDArray[Any]] = field(default_factory=dict)
    objects: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.left = self.most

    def take_all(self, above: str, group: Any, depth: int = 0) -> None:
        """What is in a group, following no link to another file."""

        def visit(name: str, one: Any) -> None:
            if not name.startswith(REFERENCES):
                self.take(f"{above}{name.replace('/', '.')}", one, depth)

        group.visititems(visit)

    def take(self, name: str, one: Any, depth: int) -> None:
        """A dataset of numbers, or what one of references refers to."""
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
            self.found[name] = values if of_matlab is None else values.T  # columns come first there
        elif depth < DEEPEST:
            for number, reference in enumerate(values.ravel()):
                if reference:
                    self.take_element(name, number, of_matlab == b"cell", one.file[reference], depth + 1)

    def take_element(self, name: str, number: int, of_cell: bool, one: Any, depth: int) -> None:
        """An element of a cell, or that field of an element of a struct array which `name` ends with."""
        above, _, last = name.rpartition(".")
        path = f"{name}[{number}]" if of_cell or not above else f"{above}[{number}].{last}"
        if hasattr(one, "visititems"):
            self.take_all(f"{path}.", one, depth)
        else:
            self.take(path, one, depth)
