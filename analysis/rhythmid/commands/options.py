"""Arguments and options that several commands share."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

Bags = Annotated[
    list[Path],
    typer.Argument(help="Bag directories, .mcap/.db3 files, or signals.yaml files that name tables."),
]
SignalsFile = Annotated[
    Path | None, typer.Option("--signals", help="signals.yaml: what each recorded channel is.")
]
JsonFile = Annotated[
    Path | None, typer.Option("--json", help="Write the result as JSON; - is standard output.")
]
ReportFile = Annotated[Path | None, typer.Option("--report", help="Write a self-contained HTML page.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Holdout = Annotated[
    list[Path] | None,
    typer.Option("--holdout", help="Held-out records: used to judge, never to fit. May be repeated."),
]
Elements = Annotated[
    list[Path] | None, typer.Option("--elements", help="Folder with elements of your own; may be repeated.")
]


def command_line() -> str:
    """This call of the command, in a form that can be typed again."""
    return shlex.join(["rhythmid", *sys.argv[1:]])
