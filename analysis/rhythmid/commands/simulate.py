"""`rhythmid simulate`: the graph's run without ROS."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands import machines
from rhythmid.commands.options import Elements, JsonFile, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid simulate model.yaml --experiment experiment.yaml --out bag",
    "rhythmid simulate model.yaml --experiment experiment.yaml --out bag --all-topics",
)


def simulate(
    model: Annotated[Path, typer.Argument(help="Model file of the machine.")],
    experiment: Annotated[Path, typer.Option("--experiment", help="Experiment file.")],
    out: Annotated[Path, typer.Option("--out", help="Bag to write.")],
    all_topics: Annotated[
        bool, typer.Option("--all-topics", help="Also record the true output and the command as it acts.")
    ] = False,
    elements: Elements = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Run an experiment without ROS, and write the bag that the ROS graph would record."""
    from rhythmid.offline_run import simulate as run
    from rhythmid.progress_bar import progress

    require_new(out, json)
    terminal = Terminal(quiet, json)
    if machines.is_machine(model):
        machines.refuse(all_topics=all_topics)
        machines.simulate_files(model, experiment, out, elements or (), json, terminal)
        return
    with progress(terminal.progress, log=False) as tell:
        tell("simulating")
        found = run(model, experiment, elements or ())
        tell("writing the bag")
        found.save(out, all_topics)
    terminal.say(f"{out}: {found.headline} of {', '.join(found.topics(all_topics))}")
    for note in found.experiment.notes:
        terminal.say(f"note: {note}")
    if json is not None:
        write_json(json, {"path": str(out), **found.to_dict()})
