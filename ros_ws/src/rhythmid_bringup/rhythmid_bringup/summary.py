"""Summary of a run on the terminal: rates, lateness, losses, applied delays."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rhythmid.body.joint_experiment import JointExperiment
from rhythmid.experiment import Experiment
from rhythmid.record.punctuality import punctuality_notes

from .supervisor import Observed, Outcome


def show(
    console: Console, experiment: Experiment | JointExperiment, observed: Observed, outcome: Outcome
) -> None:
    """Print the summary of a run."""
    if observed.figures:
        table = Table(box=None, show_header=False, pad_edge=False)
        for _ in range(3):
            table.add_column(overflow="fold")
        for spec in experiment.nodes():
            for number, (key, value) in enumerate(_rows(observed.figures.get(spec.name, {}))):
                table.add_row(spec.name if number == 0 else "", key, escape(value))
        console.print(table)
    colour = "green" if outcome.code == 0 else "red"
    console.print(
        f"[{colour}]{escape(outcome.sentence)}[/]: {observed.played:.3f} s played in {observed.elapsed:.1f} s"
    )
    for note in punctuality_notes(observed.run):
        console.print(f"[bold]{escape(note)}[/]")


def _rows(figures: Mapping[str, str]) -> list[tuple[str, str]]:
    """The figures of a node: one a row, those that are zero together in the last one. That a node is active goes without saying."""
    figures = {key: value for key, value in figures.items() if (key, value) != ("lifecycle", "active")}
    zero = [key for key, value in figures.items() if value in ("", "0")]
    shown = [(key, value) for key, value in figures.items() if key not in zero]
    return [*shown, ("none", ", ".join(zero))] if zero else shown
