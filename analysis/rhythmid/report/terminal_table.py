"""Tables on a terminal: as columns if they fit, else as paragraphs, so that nothing is cut off."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rhythmid.report.quantity import rounded

NONE = "—"
NOT_IDENTIFIABLE = "not identifiable"
BORDER = 3  # characters that a column needs beside its cells: a line and two spaces
NAME = 24  # characters of the first column below which its names are not folded


def print_table(
    console: Console,
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    right: Sequence[str] = (),
) -> None:
    """Print rows of plain text below their heads; the columns named in `right` are set to the right.

    If the terminal is too narrow, each row is a paragraph: its first cell, then a line for each further cell.
    """
    first, *rest = (max(map(cell_len, column)) for column in zip(heads, *rows, strict=True))
    if 1 + min(first, NAME) + sum(rest) + BORDER * len(heads) > console.width:
        _print_paragraphs(console, title, heads, rows)
        return
    table = Table(title=escape(title) if title else None)
    table.add_column(escape(heads[0]), overflow="fold")
    for head in heads[1:]:
        table.add_column(escape(head), justify="right" if head in right else "left", no_wrap=True)
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)


def _print_paragraphs(
    console: Console, title: str, heads: Sequence[str], rows: Sequence[Sequence[str]]
) -> None:
    if title:
        console.print(f"[italic]{escape(title)}[/]")
    for first, *rest in rows:
        console.print(f"[bold]{escape(first)}[/]")
        for head, cell in zip(heads[1:], rest, strict=True):
            if cell:
                console.print(f"  {escape(head)}: {escape(cell)}", highlight=False)


def print_markdown(console: Console, text: str) -> None:
    """Print a text with headings and tables in Markdown; its tables fit the terminal."""
    table: list[list[str]] = []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            table.append([cell.strip().replace("`", "") for cell in line.strip().strip("|").split("|")])
            continue
        if table:
            heads, _, *rows = table
            print_table(console, "", heads, rows)
            table = []
        if line.startswith("#"):
            console.print(f"[bold]{escape(line.lstrip('# '))}[/]")
        else:
            console.print(line, markup=False, highlight=False)


def print_estimates(
    console: Console, title: str, estimates: Mapping[str, Mapping[str, Any]], heading: str
) -> None:
    """Print estimates, each with `value`, `std` and `unit`, to the digits that their standard deviations bear."""
    rows = [(name, *estimate_cells(one["value"], one["std"]), one["unit"]) for name, one in estimates.items()]
    print_table(console, title, (heading, "value", "± std", "unit"), rows)


def estimate_cells(value: float | None, std: float | None) -> tuple[str, str]:
    """A value and its standard deviation as cells of a table; both end at the same digit, the second one of the latter."""
    if value is None:
        return NOT_IDENTIFIABLE, NONE
    return rounded(value, std), NONE if std is None else rounded(std, std)
