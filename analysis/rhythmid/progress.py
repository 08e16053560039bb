"""Progress of long work: whoever carries it out is handed a function that is told what begins."""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

Tell = Callable[[str], None]
Item = TypeVar("Item")
PAUSE = 5.0  # s between two words on how far work of many parts has come, at least


def silent(_: str) -> None:
    """Tell nobody."""


def counted(
    parts: Iterable[Item], count: int, what: str, tell: Tell, now: Callable[[], float] = time.monotonic
) -> Iterator[Item]:
    """The parts of some work as they are done, `count` in all, telling now and then how many are and how long the rest will take if
    it goes on like this; `now` is a clock [s]."""
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
