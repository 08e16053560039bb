"""`rhythmid check`: what is in a recording, and how good its timing is."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, SignalsFile
from rhythmid.output import require_new, write_json


def check(
    bag: Annotated[
        Path, typer.Argument(help="Bag directory, .mcap/.db3 file, table, or signals.yaml of tables.")
    ],
    signals: SignalsFile = None,
    json: JsonFile = None,
) -> None:
    """Report data quality: topics, rates, gaps, duplicates, jitter, clock. Exit code 2 if it cannot be used."""
    from rhythmid.errors import InputError
    from rhythmid.record.bag_report import quality_report

    require_new(json)
    report = quality_report(bag, signals)
    for line in report.lines():
        typer.echo(line)
    if json is not None:
        write_json(json, report.to_dict())
    if not report.usable:
        raise InputError("; ".join(report.problems))
