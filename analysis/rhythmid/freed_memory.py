"""Memory that was let go, given back to the system.

The C library keeps what is freed for what comes next. After work on many long records that is hundreds of megabytes, in pieces between
what is still in use; a forked process that fills them again gets a copy of each.
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
    """Give all memory that is free back to the system, where the C library can."""
    trim = _trim()
    if trim is not None:
        trim(0)
