"""The command `rhythmid run`, added to `rhythmid` through the entry point group `rhythmid.commands`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands.examples import epilog
from rhythmid.commands.options import Quiet, ReportFile
from rhythmid.errors import InputError
from rhythmid.ros_packages import not_installed

from . import isolation
from .start_up import start_up

EXAMPLES = ("rhythmid run experiment.yaml --out bag", "rhythmid run experiment.yaml --node plant")


def add(app: typer.Typer) -> None:
    """Add `run` to the command."""

    @app.command(epilog=epilog(EXAMPLES))
    def run(
        experiment: Annotated[Path, typer.Argument(help="Experiment file.")],
        out: Annotated[
            Path | None,
            typer.Option("--out", help="Bag to write, instead of the one that the experiment names."),
        ] = None,
        node: Annotated[
            str | None,
            typer.Option(
                "--node",
                help="Run only this node, in this process and without supervision (for one container per node).",
            ),
        ] = None,
        replace: Annotated[
            list[str] | None,
            typer.Option(
                "--replace",
                metavar="NAME=COMMAND",
                help="Run a command of yours in the place of the node plant, command_delay or measurement_delay; "
                "it gets the namespace and the topics of that node. May be repeated.",
            ),
        ] = None,
        isolated: Annotated[
            bool,
            typer.Option(
                "--isolated",
                help="Run the nodes in a network namespace of their own, which no other process can reach.",
            ),
        ] = False,
        report: ReportFile = None,
        quiet: Quiet = False,
    ) -> None:
        """Run the ROS graph of an experiment: start, supervise and stop its nodes, and write a bag."""
        if node is not None and report is not None:
            raise InputError("--node runs one node, and --report describes a whole run: give one of the two")
        if node is not None and replace:
            raise InputError("--node runs a node of ours, --replace one of yours: give one of the two")
        if isolated:
            again = [argument for argument in sys.argv[1:] if argument != "--isolated"]
            line = isolation.isolated([sys.executable, "-m", "rhythmid.cli", *again])
            os.execvp(line[0], line)
        with start_up() as state:
            try:  # ROS is slow to load, and the other commands do not need it
                from rhythmid_bringup.run import console, replacements, run_alone, run_graph
            except ModuleNotFoundError as missing:
                raise not_installed("rhythmid run", str(missing.name)) from None
            console.quiet = quiet
            if node is not None:
                raise typer.Exit(run_alone(experiment, out, node))
            raise typer.Exit(run_graph(experiment, out, state, replacements(replace or ()), report))
