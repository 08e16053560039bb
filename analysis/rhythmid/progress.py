"""Progress of long work: whoever carries it out is handed a function that is told what begins."""

from collections.abc import Callable

Tell = Callable[[str], None]


class Step(str):
    """What is under way, with how many of its `total` parts are `done`: enough to say how long the rest will take."""

    done: int
    total: int

    def __new__(cls, what: str, done: int, total: int) -> "Step":
        made = super().__new__(cls, what)
        made.done, made.total = done, total
        return made
