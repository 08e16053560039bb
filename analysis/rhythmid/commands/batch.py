"""`rhythmid batch`: many recordings answered by one manifest, and compared."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, Quiet, command_line
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid batch week.yaml",
    "rhythmid batch week.yaml --out week --jobs 4",
    "rhythmid batch week.yaml --scheduler tcp://10.0.0.5:8786",
)


def batch(
    manifest: Annotated[Path, typer.Argument(help="Which recordings, joints and models, by which command.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the answers; MANIFEST_batch if not given."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", help="Processes that work at a time; by default one a processor."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Let the workers of a Dask scheduler answer."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Answer every recording of a manifest, and say which parameters agree from run to run and rig to rig.

    Answers are kept as they come: the same command goes on where it was interrupted, and answers anew only what has changed. Exit code 1
    where a recording could not be answered.
    """
    from rhythmid.batch.batch import batch as run
    from rhythmid.progress_bar import progress

    require_new(json)
    terminal = Terminal(quiet, json)
    try:
        with progress(terminal.progress) as tell:
            found = run(manifest, out, jobs, scheduler, tell, command_line())
    except KeyboardInterrupt:
        terminal.progress.print("interrupted; finished answers are kept, and the same command goes on")
        raise
    found.show(terminal.answer)
    for name in ("index.html", "table.csv", "table.parquet"):
        if (found.folder / name).is_file():
            terminal.say(str(found.folder / name))
        else:
            terminal.say(f"{found.folder / name}: not written; it needs: pip install 'rhythmid[batch]'")
    if json is not None:
        write_json(json, found.to_dict())
    if found.failures:
        raise typer.Exit(1)
