"""`rhythmid design` of a machine of several joints."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rhythmid.output import require_new, write_json
from rhythmid.report.quantity import rounded

if TYPE_CHECKING:
    from rich.console import Console

    from rhythmid.commands.terminal import Terminal
    from rhythmid.design.joint_design import JointDesign, JointRequirements


def design_files(
    model: Path,
    wanted: "JointRequirements",
    output: Path,
    elements: Sequence[Path],
    json: Path | None,
    terminal: "Terminal",
) -> None:
    """Design references for the machine in a model file, write them, print and write the prediction."""
    from rhythmid.body.machine import Machine
    from rhythmid.design.joint_design import design_joints, save_joint_design
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.progress_bar import progress

    require_new(output, json)
    machine = Machine.load(model, load_catalogue(elements))
    with progress(terminal.progress, log=False) as tell:
        found = design_joints(machine, wanted, tell)
    save_joint_design(found, machine, model, output)
    show(found, terminal.answer)
    if json is not None:
        write_json(json, found.to_dict())
    terminal.say(f"{output}: play it with `rhythmid run {output / 'experiment.yaml'}`")


def show(found: "JointDesign", console: "Console") -> None:
    """Print a design: references, and every parameter with its predicted standard deviation."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="references")
    for column in ("joint", "middle", "rms", "largest force"):
        table.add_column(column)
    for joint, one in found.excitation.items():
        table.add_row(joint, f"{one['offset']:.3g}", f"{one['rms']:.3g}", f"{found.peak[joint]:.3g}")
    console.print(table)
    table = Table(title="predicted standard deviations")
    for column in ("parameter", "value", "std", "unit"):
        table.add_column(column)
    for name, one in found.parameters.items():
        table.add_row(name, rounded(one.value, one.std), f"{one.std:.2g}", escape(one.unit))
    for base in found.inertia.base:
        beside = "".join(f" {factor:+.3g} {name}" for name, factor in base.beside.items())
        table.add_row(
            escape(base.name + beside), rounded(base.value, base.std), f"{base.std:.2g}", escape(base.unit)
        )
    console.print(table)
    console.print(
        f"{found.inertia.rank} of {found.inertia.count} inertial parameters, or combinations of them, will be seen; condition "
        f"{found.inertia.condition:.3g}"
    )
