"""Where a command prints: its answer, its progress, and its JSON where that goes to standard output."""

from pathlib import Path
from typing import TYPE_CHECKING

from rhythmid.output import STANDARD_OUTPUT

if TYPE_CHECKING:
    pass


class Terminal:
    """Consoles of one command.

    `answer` prints the result, on standard error where standard output carries JSON; `progress` prints what is under way, on
    standard error. Both are silent where the command is `quiet`.
    """

    def __init__(self, quiet: bool = False, json: Path | None = None) -> None:
        from rich.console import Console

        self.answer: Console = Console(quiet=quiet, stderr=json == STANDARD_OUTPUT)
        self.progress: Console = Console(quiet=quiet, stderr=True)

    def say(self, line: str) -> None:
        """Print one line of the answer as it is; a long one is not broken."""
        self.answer.print(line, markup=False, highlight=False, soft_wrap=True)
