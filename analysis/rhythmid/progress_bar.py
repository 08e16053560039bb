"""Progress on the terminal: what is under way and for how long, what is left of work in equal parts, and of a given time.

How long a search will take is not known beforehand, so no bar pretends to know. Work that consists of countable parts, such as the
refits of one round, shows how many are done and how long the rest will take at the same pace; where a time is given, a bar shows how
much of it is spent.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeElapsedColumn
from rich.progress_bar import ProgressBar
from rich.table import Column
from rich.text import Text

from rhythmid.progress import Step, Tell

BAR = 20  # characters
MINUTE = 60.0  # s


class SpentColumn(ProgressColumn):
    """A bar of the share of `seconds` that has passed, and the share in figures."""

    def __init__(self, seconds: float) -> None:
        super().__init__(Column(no_wrap=True, min_width=BAR))
        self._seconds = seconds

    def render(self, task: Task) -> ProgressBar:
        """The bar of a task by the time for which it has been running."""
        return ProgressBar(self._seconds, min(task.elapsed or 0.0, self._seconds), BAR)


class SpentText(ProgressColumn):
    """The share of `seconds` that has passed, in words."""

    def __init__(self, seconds: float) -> None:
        super().__init__(Column(no_wrap=True, min_width=len(spent_words(seconds, seconds))))
        self._seconds = seconds

    def render(self, task: Task) -> Text:
        """The words of a task by the time for which it has been running."""
        return Text(spent_words(task.elapsed or 0.0, self._seconds))


def spent_words(elapsed: float, seconds: float) -> str:
    """How much of a budget [s] is spent after `elapsed` [s]. What is under way when it ends is brought to its end."""
    if elapsed >= seconds:
        return f"{seconds:g} s spent; finishing"
    return f"{100.0 * elapsed / seconds:.0f} % of {seconds:g} s spent"


def left_words(done: int, total: int, elapsed: float) -> str:
    """How many parts are done, and how long the rest will take when `done` of them took `elapsed` [s]."""
    if done <= 0 or done >= total:
        return f"{done} of {total}"
    left = elapsed * (total - done) / done
    words = f"{left:.0f} s" if left < MINUTE else f"{left / MINUTE:.0f} min"
    return f"{done} of {total}, about {words} left"


class _Pace:
    """Since when the work that is under way has been."""

    def __init__(self) -> None:
        self.what, self.began = "", time.monotonic()

    def words(self, what: str) -> str:
        """What is told, with what is left of it where that can be counted."""
        if what != self.what:
            self.what, self.began = str(what), time.monotonic()
        if not isinstance(what, Step):
            return what
        return f"{what}: {left_words(what.done, what.total, time.monotonic() - self.began)}"


@contextmanager
def progress(console: Console, budget: float | None = None, log: bool = True) -> Iterator[Tell]:
    """While this is open, what is told stands in a line with the time since it was opened, and with a `budget` [s] the share of
    it that is spent. With `log` each thing that was told is also printed, with the time at which it began."""
    columns: list[ProgressColumn] = [
        SpinnerColumn(table_column=Column(min_width=1)),
        TimeElapsedColumn(table_column=Column(min_width=len("0:00:00"))),
    ]
    if budget is not None:
        columns += [SpentColumn(budget), SpentText(budget)]
    columns.append(
        TextColumn("{task.description}", table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1))
    )
    began, pace = time.monotonic(), _Pace()

    def printed(what: str) -> None:
        if log and what != pace.what:
            console.print(f"[dim]{time.monotonic() - began:6.1f} s  {escape(what)}[/]")

    if not console.is_interactive:  # a bar would leave an empty line there

        def told(what: str) -> None:
            printed(what)
            pace.words(what)

        yield told
        return
    with Progress(*columns, console=console, transient=True, expand=True) as bar:
        task = bar.add_task("", total=None)

        def tell(what: str) -> None:
            printed(what)
            bar.update(task, description=escape(pace.words(what)))

        yield tell
