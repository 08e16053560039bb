"""`rhythmid export`: a model in the format of a simulator."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands import machines
from rhythmid.commands.options import Elements, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.output import require_new

EXAMPLES = (
    "rhythmid export model.yaml --to mujoco",
    "rhythmid export model.yaml --to urdf --joint knee --out knee.urdf",
    "rhythmid export leg.yaml --to mujoco --out leg.xml",
)


def export(
    model: Annotated[Path, typer.Argument(help="Model file, as `diagnose --save-model` writes it.")],
    to: Annotated[
        str,
        typer.Option("--to", metavar="TARGET", help="mujoco, urdf, sdf, isaac, matlab, csv or nav2."),
    ],
    out: Annotated[Path | None, typer.Option("--out", help="File to write; by default the terminal.")] = None,
    joint: Annotated[str, typer.Option("--joint", help="Name of the joint in the target.")] = "joint",
    elements: Elements = None,
    quiet: Quiet = False,
) -> None:
    """Write damping, friction, stiffness, gain, lag and delay of a model in the format of a simulator.

    A comment names each effect of the model that the target cannot express.
    """
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.export.export import exported
    from rhythmid.export.from_model import joint_of
    from rhythmid.model import Model
    from rhythmid.output import write_text

    require_new(out)
    terminal = Terminal(quiet)
    if machines.is_machine(model):
        machines.export_file(model, to, out, elements or (), terminal)
        return
    described = joint_of(Model.load(model, load_catalogue(tuple(elements or ()))), joint)
    text = exported([described], to, model.name)
    if out is None:
        typer.echo(text, nl=False)
        return
    write_text(out, text)
    terminal.say(f"{out}: {joint} for {to}")
