"""`rhythmid recover`: what is readable of a damaged recording, as a complete bag."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = ("rhythmid recover bag", "rhythmid recover broken.mcap --out whole")


def recover(
    bag: Annotated[Path, typer.Argument(help="Bag directory, .mcap or .db3 file, truncated or damaged.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Bag to write: a new folder; BAG_recovered by default."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Write every intact message of a damaged recording to a new bag, and list what was lost. BAG is not changed."""
    from rhythmid.progress_bar import progress
    from rhythmid.record.bag import Bag
    from rhythmid.record.recover import recover as write_recovered

    out = out or bag.with_name(f"{Bag(bag).name}_recovered")
    require_new(out, json)
    terminal = Terminal(quiet, json)
    with progress(terminal.progress, log=False) as tell:
        found = write_recovered(bag, out, tell=tell)
    for line in found.lines():
        terminal.say(line)
    if json is not None:
        write_json(json, found.to_dict())
