"""Return freed memory to the system.

The C library keeps freed memory for later use. After work on many long records these are hundreds of megabytes, in pieces between
memory that is still in use. A forked process that fills them again gets a copy of each piece.
"""

import ctypes
from collections.abc import Callable
from functools import lru_cache


@lru_cache(maxsize=1)
def _trim() -> Callable[[int], int] | None:
    """`malloc_trim` of the GNU C library, since version 2.8 for the memory of all threads; None with another library."""
    try:
        return ctypes.CDLL(None).malloc_trim
    except (OSError, AttributeError, TypeError):
        return None


def give_back() -> None:
    """Return all free memory to the system, if the C library can."""
    trim = _trim()
    if trim is not None:
        trim(0)
