"""Arrays read in a process of its own, for readers in machine code that trust their file: a damaged one may kill the process."""

import faulthandler
import multiprocessing
import resource
from collections.abc import Callable, Mapping
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError

Arrays = Mapping[str, NDArray[Any]]
FAILED, UNSUPPORTED = 3, 4  # exit codes: the reader refused the file, or its version


def arrays_in_own_process(read: Callable[[], Arrays], problem: str) -> Arrays:
    """What `read` returns, called in a fork of this process; arrays of objects come back as empty arrays of text.

    Nothing but numbers and texts comes back, in NumPy's own format without pickles, so that the reader cannot be made to hand over
    anything else. Raises InputError, beginning with `problem`, where it raises or the process dies; NotImplementedError where it
    raises that. Where the system cannot fork, `read` is called here.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        return read()
    with TemporaryFile() as file:
        process = multiprocessing.get_context("fork").Process(target=_write, args=(read, file), daemon=True)
        process.start()
        process.join()
        file.seek(0)
        if process.exitcode == UNSUPPORTED:
            raise NotImplementedError
        if process.exitcode == FAILED:
            raise InputError(f"{problem}: {file.read().decode()}")
        if process.exitcode != 0:
            raise InputError(f"{problem}: it is damaged such that its reader fails")
        with np.load(file, allow_pickle=False) as found:
            names, *keys = found.files
            return dict(zip(found[names].tolist(), (found[key] for key in keys), strict=True))


def _write(read: Callable[[], Arrays], file: IO[bytes]) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.disable()  # the parent tells of it, in one line
    try:
        found = read()
        arrays = (np.empty(0, dtype=str) if array.dtype.hasobject else array for array in found.values())
        np.savez(file, np.array(list(found), dtype=str), *arrays)
        file.flush()
    except NotImplementedError:
        raise SystemExit(UNSUPPORTED) from None
    except Exception as error:  # the reader of damaged files raises anything
        file.seek(0)
        file.truncate()
        file.write(" ".join(str(error).split()).encode())
        file.flush()
        raise SystemExit(FAILED) from None
