"""A deadline: the time after which iterative work ends with its present result.

It applies to everything that is called while it is open, in the same thread and in the processes forked there, so that it need not be
passed to a fit deep within a search. Work that has to be done in any case runs `without_deadline`.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

SPENT = "the time given was spent"  # reason why something was not tried
_END: ContextVar[float] = ContextVar("end", default=math.inf)


@contextmanager
def deadline(end: float) -> Iterator[None]:
    """While this is open, time is up at `end` [s, on the monotonic clock], or at an earlier deadline that is open already."""
    token = _END.set(min(end, _END.get()))
    try:
        yield
    finally:
        _END.reset(token)


@contextmanager
def without_deadline() -> Iterator[None]:
    """While this is open, time is never up."""
    token = _END.set(math.inf)
    try:
        yield
    finally:
        _END.reset(token)


def time_is_up() -> bool:
    """Whether an open deadline has passed."""
    return time.monotonic() >= _END.get()
