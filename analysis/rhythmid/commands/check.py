"""`rhythmid check`: what is in recordings, and how good their timing is."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhythmid.commands.options import Elements, JsonFile, Quiet, ReportFile, SignalsFile, command_line
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

if TYPE_CHECKING:
    from rhythmid.record.bag_report import BagReport

EXAMPLES = (
    "rhythmid check bag",
    "rhythmid check run.csv --signals signals.yaml --json -",
    "rhythmid check small.csv large.csv --signals signals.yaml",
    "rhythmid check run.csv --signals signals.yaml --model model.yaml",
    "rhythmid check bag --report page.html",
    "rhythmid check bag --strict --quiet",
)


def check(
    bags: Annotated[
        list[Path],
        typer.Argument(
            help="Bag directories, .mcap/.db3 files, tables, or signals.yaml files that name tables."
        ),
    ],
    signals: SignalsFile = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model", help="Model to check with the recordings: what it is, or what is wrong with it."
        ),
    ] = None,
    elements: Elements = None,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit code 1 if a recording has anything that may change an answer."),
    ] = False,
    json: JsonFile = None,
    report: ReportFile = None,
    quiet: Quiet = False,
) -> None:
    """Report data quality: topics, rates, gaps, duplicates, jitter, clock. Exit code 2 if a recording cannot be used.

    Several recordings are reported one after the other, and the JSON is then a list. With --model, a last line says what the model is.
    With --strict, exit code 1 if a recording has gaps, samples that are left out, damage, or anything else that may change an answer.
    """
    from rhythmid.errors import InputError
    from rhythmid.record.joint_record import joint_records
    from rhythmid.record.separate_zeros import separate_zeros_notes

    require_new(json, report)
    if report is not None and len(bags) > 1:
        raise InputError(
            "--report makes the page of one recording; give one, or list them for `rhythmid batch`"
        )
    terminal = Terminal(quiet, json)
    made, refused = _reported(bags, signals, terminal)
    records = [found.record for found in made if found.usable and found.record is not None]
    elsewhere = separate_zeros_notes(records)
    for line in elsewhere:
        terminal.say(f"note: {line}")
    if model is not None:
        from rhythmid.commands.model_line import model_lines

        try:
            of_joints = joint_records([found.path for found in made if found.usable], signals)
            for line in model_lines(model, records, elements or (), of_joints):
                terminal.say(line)
        except InputError as error:
            refused.append(str(error))
    if json is not None and made:
        told = [found.to_dict() for found in made]
        write_json(json, told if len(bags) > 1 else told[0])
    if report is not None and made:
        from rhythmid.report.recording import recording_page

        (found,) = made
        page = recording_page(found.to_dict(), found.record, found.remarks, command_line())
        terminal.report(report, page)
    if refused:
        raise InputError("; ".join(refused))
    matters = [*(line for found in made for line in found.matters), *elsewhere]
    if strict and matters:
        terminal.say(f"--strict: {len(matters)} of the remarks may change an answer, the first: {matters[0]}")
        raise typer.Exit(1)


def _reported(
    bags: list[Path], signals: Path | None, terminal: Terminal
) -> tuple[list["BagReport"], list[str]]:
    """Reports of the recordings, and why some cannot be used."""
    from rhythmid.errors import InputError
    from rhythmid.progress_bar import progress
    from rhythmid.record.bag_report import quality_report

    made: list[BagReport] = []
    refused: list[str] = []
    for bag in bags:
        try:
            with progress(terminal.progress, log=False) as tell:
                tell(f"reading {bag}")
                found = quality_report(bag, signals)
        except InputError as error:  # not a recording; the others are reported nevertheless
            refused.append(str(error))
            continue
        made.append(found)
        refused += found.problems
        for line in found.lines():
            terminal.say(line)
    return made, refused
