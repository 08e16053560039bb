"""Help on a narrow terminal: the description of an option stands below its name, where both have the whole width."""

from collections.abc import Sequence
from textwrap import wrap

import typer.core

INDENT = 4  # columns by which a description stands further to the right than its name


class NarrowHelp(typer.core.TyperCommand.context_class.formatter_class):
    """Writes names and descriptions one below the other, none wider than the terminal."""

    def write_dl(self, rows: Sequence[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        del col_max, col_spacing  # there is one column
        for name, description in rows:
            self._write(name.replace("|", "| "), self.current_indent)  # a list of choices may be broken
            self._write(description, self.current_indent + INDENT)

    def _write(self, text: str, indent: int) -> None:
        for line in wrap(text, max(self.width - indent, 1)):
            self.write(f"{'':{indent}}{line.replace('| ', '|')}\n")


def use_narrow_help() -> None:
    """Write the help of all commands in this way."""
    typer.core.TyperCommand.context_class.formatter_class = NarrowHelp
