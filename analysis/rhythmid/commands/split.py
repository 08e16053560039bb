"""`rhythmid split`: a table of several recordings as a table for each."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import Quiet
from rhythmid.commands.terminal import Terminal

EXAMPLES = (
    "rhythmid split episodes.parquet --out episodes",
    "rhythmid split log.csv --by run --out runs",
)


def split(
    table: Annotated[Path, typer.Argument(help="Table (.csv, .mat, .npz, .parquet, …).")],
    out: Annotated[Path, typer.Option("--out", help="Folder to write: a new one.")],
    by: Annotated[
        str | None,
        typer.Option("--by", metavar="COLUMN", help="Column that numbers the recordings."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write each recording of a table that holds several, one below the other, as a table of its own (.npz).

    Without --by they are told apart by a column such as episode_index, else by where the time begins anew.
    """
    from rhythmid.record.split import recordings
    from rhythmid.record.split import split as write
    from rhythmid.record.table import Table

    found = Table.load(table)
    why, rows = recordings(found, by)
    made = write(found, rows, out)
    terminal = Terminal(quiet)
    terminal.say(f"{out}: {len(made)} recordings by {why}; go on with")
    terminal.say(f"  rhythmid init {made[0]}")
