"""A batch on the terminal."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape

from rhythmid.batch.agreement import Agreement
from rhythmid.batch.wording import p_value, trend_words
from rhythmid.report.terminal_table import NONE, estimate_cells, print_table

if TYPE_CHECKING:
    from rhythmid.batch.batch import Batch

HEADS = ("parameter", "runs", "mean", "± std", "unit", "run to run", "rig to rig", "trend", "verdict")


def show(found: "Batch", console: Console) -> None:
    """Print the headline, the parameters that were compared, and what failed."""
    console.print(f"[bold]{escape(found.headline)}[/]", highlight=False)
    for subject in dict.fromkeys(one.subject for one in found.agreements):
        rows = [_row(one) for one in found.agreements if one.subject == subject and one.runs]
        if rows:
            print_table(console, f"{subject}: p-values", HEADS, rows, right=("runs",))
    for task, original in found.copies.items():
        told = f"copy: {task.name} holds the same samples as {original.name}, which alone is compared"
        console.print(escape(told), highlight=False, soft_wrap=True)
    for task, reason in found.failures.items():
        console.print(f"failed: {escape(task.name)}: {escape(reason)}", highlight=False, soft_wrap=True)


def _row(one: Agreement) -> tuple[str, ...]:
    verdict = one.verdict if not one.different else f"differs: {', '.join(one.different)}"
    slope = NONE if one.slope is None else trend_words(one)
    mean, std = estimate_cells(one.mean, one.std)
    return (
        one.name, str(len(one.runs)), mean, std, one.unit, p_value(one.runs_p), p_value(one.groups_p), slope, verdict,
    )  # fmt: skip
