"""`rhythmid split`: a table of several recordings as a table for each."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid split episodes.parquet --out episodes",
    "rhythmid split log.csv --by run --out runs",
    "rhythmid split runs.mat --out runs",
)


def split(
    table: Annotated[Path, typer.Argument(help="Table (.csv, .mat, .npz, .parquet, …).")],
    out: Annotated[Path, typer.Option("--out", help="Folder to write: a new one.")],
    by: Annotated[
        str | None,
        typer.Option("--by", metavar="COLUMN", help="Column that numbers the recordings."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Write each recording of a table that holds several, one below the other, in a struct array or each in an array, as a table of its own (.npz).

    Without --by they are told apart by the struct or array that holds each, else by a column such as episode_index, else by where the time
    begins anew.
    """
    from rhythmid.record.grouped_runs import grouped_runs
    from rhythmid.record.split import recordings, split_runs
    from rhythmid.record.split import split as write
    from rhythmid.record.table import Table

    require_new(json)
    found = Table.load(table)
    runs = grouped_runs(found) if by is None else None
    if runs is not None:
        why, made = "the struct or array that holds each", split_runs(found, runs, out)
    else:
        why, rows = recordings(found, by)
        made = write(found, rows, out)
    terminal = Terminal(quiet, json)
    terminal.say(f"{out}: {len(made)} recordings by {why}; go on with")
    terminal.say(f"  rhythmid init {made[0]}")
    if json is not None:
        write_json(json, {"path": str(out), "told_apart_by": why, "tables": [str(one) for one in made]})
