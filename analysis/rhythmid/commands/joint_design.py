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
    from rhythmid.report.terminal_table import print_table

    references = [
        (joint, f"{one['offset']:.3g}", f"{one['rms']:.3g}", f"{found.peak[joint]:.3g}")
        for joint, one in found.excitation.items()
    ]
    print_table(console, "references", ("joint", "middle", "rms", "largest force"), references)
    rows = [
        (name, rounded(one.value, one.std), f"{one.std:.2g}", one.unit)
        for name, one in found.parameters.items()
    ]
    for base in found.inertia.base:
        beside = "".join(f" {factor:+.3g} {name}" for name, factor in base.beside.items())
        rows.append((base.name + beside, rounded(base.value, base.std), f"{base.std:.2g}", base.unit))
    print_table(console, "predicted standard deviations", ("parameter", "value", "std", "unit"), rows)
    console.print(
        f"{found.inertia.rank} of {found.inertia.count} inertial parameters, or combinations of them, will be seen; condition "
        f"{found.inertia.condition:.3g}"
    )
