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
    manifest: Annotated[
        Path, typer.Argument(help="YAML file: which recordings, joints and models, and by which command.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the answers; MANIFEST_batch by default."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", help="Number of parallel processes; by default one per processor."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Use the workers of this Dask scheduler."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Identify or diagnose every recording of a manifest, and say which parameters agree between runs and between rigs.

    Each answer is saved as soon as it is found. The same command resumes after an interruption, and repeats only what has changed.
    Exit code 1 if there is no answer for a recording.
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
