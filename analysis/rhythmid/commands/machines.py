"""What the commands do with a model of several joints: `rhythmid diagnose`, `identify` and `simulate` come here where the model file
has a `body:`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rhythmid.commands.options import command_line
from rhythmid.errors import InputError
from rhythmid.output import write_json

if TYPE_CHECKING:
    from rhythmid.body.machine import Machine
    from rhythmid.commands.terminal import Terminal
    from rhythmid.elements.catalogue import Catalogue
    from rhythmid.record.joint_record import JointRecord

SUFFIXES = {"mujoco": ".xml", "urdf": ".urdf"}
APPLIED = "rhythmid.mujoco.apply(model, data) before each mj_step makes all of it act: docs/legs.md"
OF_ONE_AXIS = "{} is for a machine of one axis; leave it out"


def is_machine(model: Path | None) -> bool:
    """Whether a model file describes a machine of several joints."""
    if model is None:
        return False
    from rhythmid.body.machine import describes_machine

    return describes_machine(model)


def loaded(
    model: Path, catalogue: "Catalogue", bags: Sequence[Path], signals: Path | None
) -> "tuple[Machine, list[JointRecord]]":
    """The machine and its records. Raises InputError where no signals say which joint is what."""
    from rhythmid.body.machine import Machine
    from rhythmid.record.joint_record import load_joint_records

    machine = Machine.load(model, catalogue)
    return machine, [] if not bags else load_joint_records(bags, _signals(bags, signals))


def _signals(bags: Sequence[Path], signals: Path | None) -> Path:
    if signals is not None:
        return signals
    if len(bags) == 1 and bags[0].suffix in (".yaml", ".yml"):
        return bags[0]
    raise InputError("a machine of several joints needs --signals: a signals.yaml with  joints: [hip, knee]")


def _held_out(holdout: Sequence[Path], bags: Sequence[Path], signals: Path | None) -> "list[JointRecord]":
    from rhythmid.record.joint_record import load_joint_records

    return load_joint_records(holdout, _signals(bags, signals)) if holdout else []


def _source(model: Path, bags: Sequence[Path]) -> str:
    return f"{model.name} with {', '.join(bag.name for bag in bags)}"


def refuse(**given: object) -> None:
    """Raise InputError for options that have no meaning for several joints."""
    for name, value in given.items():
        if value is not None and value is not False:
            raise InputError(OF_ONE_AXIS.format(f"--{name.replace('_', '-')}"))


def diagnose_files(
    bags: Sequence[Path],
    model: Path,
    signals: Path | None,
    holdout: Sequence[Path],
    elements: Sequence[Path],
    json: Path | None,
    report: Path | None,
    save_model: Path | None,
    budget: float | None,
    terminal: "Terminal",
) -> None:
    """Diagnose the machine of several joints in a model file, print and write the answer."""
    from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.progress_bar import progress

    catalogue = load_catalogue(elements)
    machine, records = loaded(model, catalogue, bags, signals)
    unseen = _held_out(holdout, bags, signals)
    with progress(terminal.progress, budget) as tell:
        answer = diagnose_machine(records, machine, unseen, catalogue, tell, budget)
    answer.show(terminal.answer)
    if json is not None:
        write_json(json, answer.diagnosis.to_dict())
    if report is not None:
        from rhythmid.diagnose.joints.joint_present import present_machine

        page = present_machine(answer, machine, _source(model, bags), command_line())
        terminal.report(report, page)
    saved(answer.machine, save_model, terminal)


def saved(machine: "Machine", path: Path | None, terminal: "Terminal") -> None:
    """Write a machine where that is asked for: as YAML, or as MJCF (.xml) or URDF (.urdf)."""
    if path is None:
        return
    from rhythmid.body.write_back import save_machine

    if left := save_machine(machine, path):
        terminal.say(f"{path}: {'; '.join(left)}")
        terminal.say(APPLIED if path.suffix == ".xml" else "a .yaml holds all of it")


def export_file(
    model: Path, to: str, out: Path | None, elements: Sequence[Path], terminal: "Terminal"
) -> None:
    """Write the machine of several joints in a model file as MJCF or URDF. Raises InputError for another target."""
    from rhythmid.body.machine import Machine
    from rhythmid.elements.catalogue import load_catalogue

    if to not in SUFFIXES:
        raise InputError(f"--to {to}: a machine of several joints is written as {' or '.join(SUFFIXES)}")
    if out is None or out.suffix != SUFFIXES[to]:
        raise InputError(f"--out: name a file that ends in {SUFFIXES[to]}")
    saved(Machine.load(model, load_catalogue(elements)), out, terminal)
    terminal.say(f"{out}: {to}")


def identify_files(
    bags: Sequence[Path],
    model: Path,
    signals: Path | None,
    holdout: Sequence[Path],
    elements: Sequence[Path],
    json: Path | None,
    report: Path | None,
    save_model: Path | None,
    terminal: "Terminal",
) -> None:
    """Identify the machine of several joints in a model file, print and write the answer."""
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.identify.joints.joint_identification import identify_machine
    from rhythmid.progress_bar import progress

    machine, records = loaded(model, load_catalogue(elements), bags, signals)
    unseen = _held_out(holdout, bags, signals)
    with progress(terminal.progress) as tell:
        found = identify_machine(records, machine, unseen, tell)
    found.show(terminal.answer)
    if json is not None:
        write_json(json, found.to_dict())
    if report is not None:
        from rhythmid.identify.joints.joint_present import present_identified

        page = present_identified(found, machine, _source(model, bags), command_line())
        terminal.report(report, page)
    saved(found.machine, save_model, terminal)


def simulate_files(
    model: Path,
    experiment: Path,
    out: Path,
    elements: Sequence[Path],
    json: Path | None,
    terminal: "Terminal",
) -> None:
    """Run an experiment with the machine of several joints in a model file, and write its bag."""
    from rhythmid.body.joint_run import run_experiment
    from rhythmid.body.machine import Machine
    from rhythmid.elements.catalogue import load_catalogue

    made = run_experiment(Machine.load(model, load_catalogue(elements)), experiment)
    made.save(out)
    terminal.say(f"{out}: {made.headline} of {', '.join(made.messages.topics)}")
    if json is not None:
        write_json(json, {"path": str(out), **made.to_dict()})
