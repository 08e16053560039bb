"""`rhythmid simulate`: the graph's run without ROS."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands import machines
from rhythmid.commands.options import Elements
from rhythmid.output import require_new


def simulate(
    model: Annotated[Path, typer.Argument(help="Model file of the machine.")],
    experiment: Annotated[Path, typer.Option("--experiment", help="Experiment file.")],
    out: Annotated[Path, typer.Option("--out", help="Bag to write.")],
    all_topics: Annotated[
        bool, typer.Option("--all-topics", help="Record the true output and command too.")
    ] = False,
    elements: Elements = None,
) -> None:
    """Run an experiment without ROS: writes the bag that the graph would record."""
    from rhythmid.experiment import Experiment, perform
    from rhythmid.record.bag_writer import write_bag

    require_new(out)
    if machines.is_machine(model):
        machines.refuse(all_topics=all_topics)
        machines.simulate_files(model, experiment, out, elements or ())
        return
    described = Experiment.load(experiment, tuple(elements or ()), model)
    messages = perform(described)
    wanted = (
        list(messages) if all_topics else [topic for topic in described.record.topics if topic in messages]
    )
    write_bag(
        out,
        {f"{described.namespace}/{topic}": messages[topic] for topic in wanted},
        storage=described.record.storage,
        run=described.description(),
        joint=described.joint,
        namespace=described.namespace,
    )
    typer.echo(f"{out}: {described.count} samples at {described.time.rate} Hz of {', '.join(wanted)}")
