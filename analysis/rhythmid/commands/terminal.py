"""Where a command prints: its answer, its progress, and its JSON where that goes to standard output."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from rhythmid.output import STANDARD_OUTPUT

if TYPE_CHECKING:
    from rich.console import Console

    from rhythmid.report.page import Page

WHOLE = 100_000  # columns if their number is unknown, as in a file: longer than any line


class Terminal:
    """Consoles of one command.

    `answer` prints the result, on standard error if standard output carries JSON. `progress` prints the present step, on
    standard error. Both are silent if the command is `quiet`. They break lines to the width of the terminal, or to COLUMNS. Without
    either, lines are not broken.
    """

    def __init__(self, quiet: bool = False, json: Path | None = None) -> None:
        self.answer: Console = console(quiet, json == STANDARD_OUTPUT)
        self.progress: Console = console(quiet, stderr=True)

    def say(self, line: str) -> None:
        """Print one line of the answer as it is; a long one is not broken."""
        self.answer.print(line, markup=False, highlight=False, soft_wrap=True)

    def report(self, path: Path, page: "Page") -> None:
        """Write a report, and say where it is."""
        from rhythmid.report.page import write_page

        write_page(path, page)
        self.say(f"report: {path}")


def console(quiet: bool = False, stderr: bool = False) -> "Console":
    """A console on standard output or standard error, as wide as the terminal."""
    from rich.console import Console

    made = Console(quiet=quiet, stderr=stderr)
    if not made.is_terminal and not os.environ.get("COLUMNS"):
        made.width = WHOLE
    return made
