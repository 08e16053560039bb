"""`rhythmid table1`: the paper's nine experiments, side by side with its table."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from rhythmid.commands.options import JsonFile
from rhythmid.output import require_new, write_json


def table1(
    json: JsonFile = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="New folder that keeps the nine bags and the figures.")
    ] = None,
) -> None:
    """Simulate the paper's nine experiments, identify each from its bag alone, and print its Table 1 beside ours."""
    import tempfile

    from rhythmid.table1 import format_table
    from rhythmid.table1 import table1 as run

    require_new(json, out)
    folder = out or Path(tempfile.mkdtemp(prefix="rhythmid_table1_"))
    with Console(stderr=True).status("simulating") as status:
        rows = run(folder, tell=status.update)
    typer.echo(format_table(rows))
    typer.echo(f"bags and figures: {folder}")
    if json is not None:
        write_json(json, [row.result for row in rows])
