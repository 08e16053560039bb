"""The report of a run: how it ended, the figures of its nodes, then the recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rhythmid.commands.options import command_line
from rhythmid.errors import InputError
from rhythmid.record.bag_report import quality_report
from rhythmid.record.punctuality import punctuality_notes
from rhythmid.report.blocks import Bullets, Fold, Paragraph, Section, Table
from rhythmid.report.page import Page, write_page
from rhythmid.report.quantity import sentence
from rhythmid.report.recording import recording_page

from .supervisor import Observed, Outcome


def write_report(path: Path, bag: Path, observed: Observed, outcome: Outcome) -> None:
    """Write the page of a run that left this bag. Raises InputError if its place is not writable, or the run left nothing readable."""
    write_page(path, run_page(bag, observed, outcome))


def run_page(bag: Path, observed: Observed, outcome: Outcome) -> Page:
    """The page of a run that left this bag. Raises InputError if this is not a recording."""
    if not bag.is_dir():
        raise InputError(f"{bag}: the run left no bag, so there is nothing to report")
    found = quality_report(bag)
    section = _run(observed, outcome)
    good = outcome.code == 0
    verdict = ("The run finished", "good") if good else ("The run broke off", "open")
    return recording_page(found.to_dict(), found.record, found.remarks, command_line(), (section,), verdict)


def _run(observed: Observed, outcome: Outcome) -> Section:
    lead = f"{sentence(outcome.sentence)} {observed.played:.3f} s were played in {observed.elapsed:.1f} s."
    notes = punctuality_notes(observed.run)
    return Section(
        "The run",
        (
            Paragraph(lead, "lead"),
            *([Bullets(tuple(map(sentence, notes)))] if notes else []),
            *(_node(name, told, outcome.code != 0) for name, told in sorted(observed.figures.items())),
        ),
    )


def _node(name: str, told: Mapping[str, str], opened: bool) -> Fold:
    """What a node reports; it matters where something went wrong."""
    rows = tuple((key, value or "none") for key, value in told.items())
    return Fold(
        f"What {name} reports", (Table("At the end of the run.", ("quantity", "value"), rows),), opened
    )
