"""Reads arrays in a separate process, for compiled readers that trust their file: a damaged file may kill the process."""

import faulthandler
import os
import resource
from collections.abc import Callable, Mapping
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError

Arrays = Mapping[str, NDArray[Any]]
FAILED = 3  # exit code: the reader rejected the file


def arrays_in_own_process(read: Callable[[], Arrays], problem: str) -> Arrays:
    """Result of `read`, called in a fork of this process; arrays of objects are returned as empty arrays of text.

    Only numbers and texts are returned, in NumPy's own format without pickles, so that the reader cannot pass on
    anything else. Raises InputError, beginning with `problem`, where the reader raises or the process dies. Where
    the system cannot fork, `read` is called in this process.
    """
    if not hasattr(os, "fork"):
        return read()
    with TemporaryFile() as file:
        child = os.fork()  # not multiprocessing: its workers may have no child processes
        if child == 0:
            code = 1
            try:
                code = _write(read, file)
            finally:
                os._exit(code)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        file.seek(0)
        if code == FAILED:
            raise InputError(f"{problem}: {file.read().decode()}")
        if code != 0:
            raise InputError(f"{problem}: it is damaged such that its reader fails")
        with np.load(file, allow_pickle=False) as found:
            names, *keys = found.files
            return dict(zip(found[names].tolist(), (found[key] for key in keys), strict=True))


def _write(read: Callable[[], Arrays], file: IO[bytes]) -> int:
    """Write the result of `read`, or the reason why it fails; the exit code says which."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.disable()  # the parent reports the failure in one line
    try:
        found = read()
        arrays = (np.empty(0, dtype=str) if array.dtype.hasobject else array for array in found.values())
        np.savez(file, np.array(list(found), dtype=str), *arrays)
        file.flush()
    except Exception as error:  # the reader may raise any exception on a damaged file
        file.seek(0)
        file.truncate()
        file.write(" ".join(str(error).split()).encode())
        file.flush()
        return FAILED
    return 0
