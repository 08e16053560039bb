"""`rhythmid check`: what is in a recording, and how good its timing is."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, Quiet, SignalsFile
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid check bag",
    "rhythmid check run.csv --signals signals.yaml --json -",
)


def check(
    bag: Annotated[
        Path, typer.Argument(help="Bag directory, .mcap/.db3 file, table, or signals.yaml of tables.")
    ],
    signals: SignalsFile = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Report data quality: topics, rates, gaps, duplicates, jitter, clock. Exit code 2 if it cannot be used."""
    from rhythmid.errors import InputError
    from rhythmid.progress_bar import progress
    from rhythmid.record.bag_report import quality_report

    require_new(json)
    terminal = Terminal(quiet, json)
    with progress(terminal.progress, log=False) as tell:
        tell(f"reading {bag}")
        report = quality_report(bag, signals)
    for line in report.lines():
        terminal.say(line)
    if json is not None:
        write_json(json, report.to_dict())
    if not report.usable:
        raise InputError("; ".join(report.problems))
