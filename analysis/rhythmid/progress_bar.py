"""Progress on the terminal: what is under way and for how long, and how much of a given time is spent.

The length of a search is not known in advance. So there is a bar only if a budget is given, and it shows the share of the
budget that has passed.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from queue import Empty, SimpleQueue
from threading import Thread

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeElapsedColumn
from rich.progress_bar import ProgressBar
from rich.table import Column
from rich.text import Text

from rhythmid.progress import Tell

BAR = 20  # characters
SILENT = 20.0  # [s] without a word after which the present step is told again


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
    """How much of a budget [s] is spent after `elapsed` [s]. Steps that an answer needs are done in any case."""
    if elapsed >= seconds:
        return f"{seconds:g} s spent; finishing"
    return f"{100.0 * elapsed / seconds:.0f} % of {seconds:g} s spent"


@contextmanager
def _reminded(printed: Tell) -> Iterator[Tell]:
    """While this is open, what was told last is told again after each `SILENT` seconds of silence."""
    told: SimpleQueue[str | None] = SimpleQueue()

    def remind() -> None:
        last = None
        while True:
            try:
                last = told.get(timeout=SILENT)
                if last is None:
                    return
            except Empty:
                if last is not None:
                    printed(f"still {last}")

    def tell(what: str) -> None:
        printed(what)
        told.put(what)

    reminder = Thread(target=remind, daemon=True)
    reminder.start()
    try:
        yield tell
    finally:
        told.put(None)
        reminder.join()


@contextmanager
def progress(console: Console, budget: float | None = None, log: bool = True) -> Iterator[Tell]:
    """While this is open, what is told stands in a line with the time since it was opened, and with a `budget` [s] the share of
    it that is spent. With `log` each thing that was told is also printed, with the time at which it began; where no line shows the
    time, as in a file, it is printed again after each `SILENT` seconds in which nothing else was told."""
    columns: list[ProgressColumn] = [
        SpinnerColumn(table_column=Column(min_width=1)),
        TimeElapsedColumn(table_column=Column(min_width=len("0:00:00"))),
    ]
    if budget is not None:
        columns += [SpentColumn(budget), SpentText(budget)]
    columns.append(
        TextColumn("{task.description}", table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1))
    )
    began = time.monotonic()

    def printed(what: str) -> None:
        if log:
            console.print(f"[dim]{time.monotonic() - began:6.1f} s  {escape(what)}[/]")

    if not console.is_interactive:  # a bar would leave an empty line there
        with _reminded(printed) if log else nullcontext(printed) as told:
            yield told
        return
    with Progress(*columns, console=console, transient=True, expand=True) as bar:
        task = bar.add_task("", total=None)

        def tell(what: str) -> None:
            bar.update(task, description=escape(what))
            printed(what)

        yield tell
