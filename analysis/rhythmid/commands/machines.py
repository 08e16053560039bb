"""What the commands do with a model of several joints: `rhythmid diagnose`, `identify` and `simulate` come here where the model file
has a `body:`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rhythmid.errors import InputError
from rhythmid.output import write_json
from rhythmid.report.quantity import rounded

if TYPE_CHECKING:
    from rich.console import Console

    from rhythmid.body.machine import Machine
    from rhythmid.commands.terminal import Terminal
    from rhythmid.diagnose.joints.joint_answer import MachineDiagnosis
    from rhythmid.elements.catalogue import Catalogue
    from rhythmid.identify.joints.joint_identification import MachineIdentification
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
    from rhythmid.record.joint_record import load_joint_records

    catalogue = load_catalogue(elements)
    machine, records = loaded(model, catalogue, bags, signals)
    unseen = load_joint_records(holdout, _signals(bags, signals)) if holdout else []
    with progress(terminal.progress, budget) as tell:
        answer = diagnose_machine(records, machine, unseen, catalogue, tell, budget)
    show_diagnosis(answer.diagnosis, terminal.answer)
    if json is not None:
        write_json(json, answer.diagnosis.to_dict())
    if report is not None:
        from rhythmid.commands.options import command_line
        from rhythmid.diagnose.joints.joint_present import present_machine
        from rhythmid.report.page import write_page

        source = f"{model.name} with {', '.join(bag.name for bag in bags)}"
        write_page(report, present_machine(answer, machine, source, command_line()))
        terminal.say(f"report: {report}")
    saved(answer.machine, save_model, terminal)


def show_diagnosis(found: "MachineDiagnosis", console: "Console") -> None:
    """Print a diagnosis: the verdict, what is missing at which joint, then a row for every joint."""
    from rich.markup import escape
    from rich.table import Table

    console.print(f"[bold]{found.verdict.replace('_', ' ')}[/]: {escape(found.summary)}")
    for one in found.missing:
        what = f"mass of {one.link}" if one.link else one.element
        console.print(
            f"[bold]{escape(one.joint)}: {escape(what)}[/]   {escape(one.equation)}   (probability {one.probability:.2f}, "
            f"{100.0 * one.share:.3g} % of the joint's mismatch)"
        )
        for name, value in one.parameters.items():
            std = "" if value.std is None else f" ± {value.std:.2g}"
            console.print(f"  {name}: {rounded(value.value, value.std)}{std} {escape(value.unit)}")
    for group in found.indistinguishable:
        console.print(f"indistinguishable here: {escape(', '.join(group))}")
    table = Table(title="error of the effort on data that no fit has seen, as a share of it")
    for column in ("joint", "verdict", "nominal", "augmented", "left"):
        table.add_column(column)
    for joint, one in found.joints.items():
        before, after = (one.fit[name].heldout_nrmse for name in ("refitted_nominal", "augmented"))
        left = (
            f"{100.0 * one.remainder.share:.2g} % of the mismatch" if one.remainder.significant else "noise"
        )
        table.add_row(joint, one.verdict.replace("_", " "), _share(before), _share(after), left)
    console.print(table)
    for joint, why in found.not_judged.items():
        console.print(f"not judged: {escape(joint)}: {escape(why)}")
    for label, lines in (("assumption", found.assumptions), ("note", found.notes)):
        for line in lines:
            console.print(f"{label}: {escape(line)}")
    console.print(f"next experiment: {escape(found.next_experiment)}")


def _share(error: float | None) -> str:
    return "—" if error is None else f"{100.0 * error:.3g} %"


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
    elements: Sequence[Path],
    json: Path | None,
    save_model: Path | None,
    terminal: "Terminal",
) -> None:
    """Identify the machine of several joints in a model file, print and write the answer."""
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.identify.joints.joint_identification import identify_machine
    from rhythmid.progress_bar import progress

    machine, records = loaded(model, load_catalogue(elements), bags, signals)
    with progress(terminal.progress) as tell:
        found = identify_machine(records, machine, tell=tell)
    show_identification(found, terminal.answer)
    if json is not None:
        write_json(json, found.to_dict())
    saved(found.machine, save_model, terminal)


def show_identification(found: "MachineIdentification", console: "Console") -> None:
    """Print an identification: parameters, inertias, errors, and what the records do not tell apart."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="parameters")
    for column in ("name", "value", "95 % interval", "unit"):
        table.add_column(column)
    for name, one in found.parameters.items():
        low, high = (rounded(end, one.std) for end in one.interval)
        table.add_row(name, rounded(one.value, one.std), f"{low} to {high}", escape(one.unit))
    console.print(table)
    if found.inertia is not None:
        seen = found.inertia
        console.print(
            f"{seen.rank} of {seen.count} inertial parameters, or combinations of them, are seen; condition {seen.condition:.3g}"
        )
        for link, values in seen.links.items():
            centre = ", ".join(f"{values[name] / values['m']:.4g}" for name in ("mx", "my", "mz"))
            console.print(f"{escape(link)}: mass {values['m']:.4g} kg, centre at ({centre}) m")
    for joint, error in found.effort_nrmse.items():
        runs = ", ".join(f"{100.0 * one[joint]:.3g} % {name}" for name, one in found.free_run.items())
        console.print(
            f"{escape(joint)}: effort missed by {100.0 * error:.3g} %; free run, held out: {runs or 'none'}"
        )
    for label, lines in (("not separable", found.not_separable), ("note", found.notes)):
        for line in lines:
            console.print(f"{label}: {escape(line)}")


def simulate_files(
    model: Path, experiment: Path, out: Path, elements: Sequence[Path], terminal: "Terminal"
) -> None:
    """Run an experiment with the machine of several joints in a model file, and write its bag."""
    from rhythmid.body.joint_experiment import JointExperiment, perform
    from rhythmid.body.machine import Machine
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.record.joint_messages import write_joint_bag

    machine = Machine.load(model, load_catalogue(elements))
    made = perform(machine, JointExperiment.load(experiment))
    write_joint_bag(out, {topic: (made.stamp_ns, *rest) for topic, rest in made.topics.items()})
    terminal.say(f"{out}: {len(made.stamp_ns)} samples of {', '.join(made.topics)}")
