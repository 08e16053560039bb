"""Print a comparison."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.markup import escape

from rhythmid.report.quantity import plus_minus


def show(result: Mapping[str, Any], console: Console) -> None:
    """Print a comparison from its JSON data."""
    alignment = result["alignment"]
    offset = alignment["offset"]
    late = plus_minus(offset["value"], 2.0 * offset["std"])
    console.print(
        f"[bold]{escape(result['simulation'])}[/] against [bold]{escape(result['recording'])}[/]: aligned by the "
        f"{alignment['by']}, the recording is {late} s later; {result['overlap']['value']:.4g} s in common"
    )
    console.print(result["summary"], markup=False)
    for note in result["notes"]:
        console.print(f"note: {note}", markup=False)
