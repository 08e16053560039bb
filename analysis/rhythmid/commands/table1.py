"""`rhythmid table1`: the paper's nine experiments, side by side with its table."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid table1",
    "rhythmid table1 --out folder --json table1.json",
)


def table1(
    json: JsonFile = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="New folder that keeps the nine bags and the figures.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Simulate the paper's nine experiments, identify each from its bag alone, and print the results beside its Table 1."""
    import tempfile

    from rhythmid.progress_bar import progress
    from rhythmid.table1 import show
    from rhythmid.table1 import table1 as run

    require_new(json, out)
    terminal = Terminal(quiet, json)
    folder = out or Path(tempfile.mkdtemp(prefix="rhythmid_table1_"))
    with progress(terminal.progress, log=False) as tell:
        rows = run(folder, tell=tell)
    show(rows, terminal.answer)
    terminal.say(f"bags and figures: {folder}")
    if json is not None:
        write_json(json, [row.result for row in rows])
