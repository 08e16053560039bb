"""Progress of long work: the worker gets a function that it calls at the beginning of each step."""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

Tell = Callable[[str], None]
Item = TypeVar("Item")
PAUSE = 5.0  # s, smallest time between two reports on the progress of many parts


def silent(_: str) -> None:
    """Report nothing."""


def counted(
    parts: Iterable[Item], count: int, what: str, tell: Tell, now: Callable[[], float] = time.monotonic
) -> Iterator[Item]:
    """The parts of some work, `count` in all, with an occasional report of how many are done and how long the rest will take at the
    present rate; `now` is a clock [s]."""
    begun = told = now()
    for done, part in enumerate(parts, start=1):
        if done < count and now() - told >= PAUSE:
            told = now()
            tell(
                f"{what}: {done} of {count} done, about {in_words((told - begun) / done * (count - done))} left"
            )
        yield part


def in_words(seconds: float) -> str:
    """A time in whole seconds, or in minutes from two of them on."""
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"
