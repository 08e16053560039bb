"""`rhythmid check`: what is in a recording, and how good its timing is."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.options import JsonFile, Quiet, ReportFile, SignalsFile, command_line
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid check bag",
    "rhythmid check run.csv --signals signals.yaml --json -",
    "rhythmid check bag --report page.html",
)


def check(
    bag: Annotated[
        Path, typer.Argument(help="Bag directory, .mcap/.db3 file, table, or signals.yaml of tables.")
    ],
    signals: SignalsFile = None,
    json: JsonFile = None,
    report: ReportFile = None,
    quiet: Quiet = False,
) -> None:
    """Report data quality: topics, rates, gaps, duplicates, jitter, clock. Exit code 2 if it cannot be used."""
    from rhythmid.errors import InputError
    from rhythmid.progress_bar import progress
    from rhythmid.record.bag_report import quality_report

    require_new(json, report)
    terminal = Terminal(quiet, json)
    with progress(terminal.progress, log=False) as tell:
        tell(f"reading {bag}")
        found = quality_report(bag, signals)
    for line in found.lines():
        terminal.say(line)
    if json is not None:
        write_json(json, found.to_dict())
    if report is not None:
        from rhythmid.report.page import write_page
        from rhythmid.report.recording import recording_page

        write_page(report, recording_page(found.to_dict(), found.record, found.remarks, command_line()))
        terminal.say(f"report: {report}")
    if not found.usable:
        raise InputError("; ".join(found.problems))
