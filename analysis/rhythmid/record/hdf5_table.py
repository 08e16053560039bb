"""Arrays of an HDF5 file by the path to them, MATLAB's own of version 7.3 among them (https://docs.hdfgroup.org)."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.compression import largest
from rhythmid.record.own_process import arrays_in_own_process

SIGNATURE = b"\x89HDF\r\n\x1a\n"
STARTS = (0, 512)  # bytes in front of it that are looked behind: MATLAB writes a header of its own there
OF_MATLAB = "MATLAB_class"  # attribute by which MATLAB says what a dataset is
NUMBERS = "fiub"  # kinds of data types


def is_hdf5(path: Path) -> bool:
    """Whether a file holds HDF5, whatever it is called. Raises OSError where it cannot be opened."""
    with path.open("rb") as file:
        return any(file.seek(start) == start and file.read(len(SIGNATURE)) == SIGNATURE for start in STARTS)


def read_hdf5(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of numbers with one or two dimensions, `group.name` for those within groups.

    What refers to other files is not followed, and texts, references and cells are left out. Raises InputError where h5py is not installed, or the file is
    damaged or claims to hold more than its size allows.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"{path}: reading HDF5 needs h5py: pip install h5py, or in MATLAB  save(…, '-v7')"
        ) from None

    def read() -> dict[str, NDArray[Any]]:
        found: dict[str, NDArray[Any]] = {}
        most = largest(path.stat().st_size)

        def take(name: str, one: Any) -> None:
            nonlocal most
            if not isinstance(one, h5py.Dataset) or one.dtype.kind not in NUMBERS or one.ndim not in (1, 2):
                return
            of_matlab = one.attrs.get(OF_MATLAB)
            if of_matlab in (b"char", b"cell") or one.external or one.is_virtual:
                return
            most -= one.nbytes
            if most < 0:
                raise ValueError(f"claims to hold more than {largest(path.stat().st_size)} bytes")
            values = np.asarray(one[()])
            found[name.replace("/", ".")] = (
                values if of_matlab is None else values.T
            )  # columns come first there

        with h5py.File(path, "r") as file:
            file.visititems(take)  # follows no link to another file
        return found

    return dict(arrays_in_own_process(read, f"{path}: cannot be read as a table"))
