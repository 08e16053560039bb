"""`rhythmid run`: from an experiment file to a bag and a summary."""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from rhythmid.body.joint_experiment import JointExperiment
from rhythmid.body.joint_graph import describes_joints
from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.output import require_new, require_writable

from .arguments import command, ros_arguments
from .environment import own_domain, run_environment
from .report import write_report
from .start_up import STOPPED, StartUp
from .summary import show
from .supervisor import Supervisor

REPLACEABLE = ("plant", "command_delay", "measurement_delay")  # the other nodes drive and record a run
console = Console(stderr=True, highlight=False, soft_wrap=True)


Runnable = Experiment | JointExperiment


def experiment_in(path: Path) -> Runnable:
    """The experiment in a file, of one axis or of several joints."""
    return JointExperiment.load(path) if describes_joints(path) else Experiment.load(path)


def load(path: Path, out: Path | None) -> Runnable:
    """The experiment with its bag's absolute path. Raises InputError if the bag's place exists or is not writable."""
    experiment = experiment_in(path)
    bag = (out or experiment.record.path).absolute()
    if os.path.lexists(bag):
        raise InputError(f"{bag}: exists already and is not overwritten; choose another path or remove it")
    require_writable(bag)
    return experiment.with_record(path=bag)


def replacements(given: Sequence[str]) -> dict[str, list[str]]:
    """Name of a node -> command that runs in its place, from words `NAME=COMMAND`. Raises InputError for anything else."""
    found: dict[str, list[str]] = {}
    for text in given:
        name, _, line = text.partition("=")
        try:
            words = shlex.split(line)
        except ValueError as error:
            raise InputError(f"--replace {text}: {error}") from None
        if name not in REPLACEABLE or not words:
            raise InputError(
                f"--replace {text}: NAME=COMMAND is expected, NAME one of {', '.join(REPLACEABLE)}"
            )
        if name in found:
            raise InputError(f"--replace {text}: {name} is replaced twice")
        if shutil.which(words[0]) is None:
            raise InputError(f"--replace {text}: no such command: {words[0]}")
        found[name] = words
    return found


def run_graph(
    path: Path,
    out: Path | None,
    state: StartUp,
    replaced: Mapping[str, Sequence[str]] | None = None,
    report: Path | None = None,
) -> int:
    """Run the whole graph under supervision, with the commands `replaced` in the place of nodes; write a page `report`.

    The exit code is 0 if the run was completed or the user stopped it (no bag is left if it had not begun), 1 if a node died or the excitation
    stopped by itself. Raises InputError when a node refuses its parameters.
    """
    require_new(report)
    experiment = load(path, out)
    if isinstance(experiment, Experiment) and "plant" in (replaced or ()):
        experiment = experiment.as_stated
    folder = Path(tempfile.mkdtemp(prefix="rhythmid-"))
    with own_domain() as domain, interruptions() as interrupted:
        state.begun = True
        environment = run_environment(os.environ, domain, folder)
        os.environ.update(environment)  # the supervisor's own node must be in the same domain
        supervisor = Supervisor(experiment, folder, environment, console, interrupted, replaced)
        outcome = supervisor.run()
    if outcome.code != 1:
        shutil.rmtree(folder, ignore_errors=True)
    if outcome.code == 2:
        raise InputError(outcome.sentence)
    if outcome.code == 0 and not supervisor.observed.run:  # the user stopped it before the excitation played
        shutil.rmtree(experiment.record.path, ignore_errors=True)
        waited = f"; it waited for {supervisor.waited_for}" if supervisor.waited_for else ""
        console.print(escape(STOPPED + waited))
        return 0
    mend(experiment.record.path)
    show(console, experiment, supervisor.observed, outcome)
    for note in experiment.notes if isinstance(experiment, Experiment) else ():
        console.print(f"note: {escape(note)}")
    if report is not None:
        write_report(report, experiment.record.path, supervisor.observed, outcome)
        console.print(f"report: {report}")
    if outcome.code == 1:
        console.print(f"parameters and logs of the nodes: {folder}")
    return outcome.code


def mend(bag: Path) -> None:
    """Print the place of the bag; if its recorder died, first recover what it had written."""
    if bag.is_dir() and not (bag / "metadata.yaml").is_file():
        from rhythmid.record.recover import recover

        broken = Path(tempfile.mkdtemp(prefix=f"{bag.name}.broken.", dir=bag.parent)) / bag.name
        bag.rename(broken)
        console.print(f"the recorder did not close the bag; what it left is in {broken}")
        try:
            recover(broken, bag)
        except InputError as nothing:
            console.print(str(nothing))
    if bag.is_dir():
        console.print(f"bag: {bag}")


def run_alone(path: Path, out: Path | None, name: str) -> int:
    """Become one node of the experiment; without supervisor the excitation starts by itself."""
    experiment = load(path, out) if name == "recorder" else experiment_in(path)
    specs = {spec.name: spec for spec in experiment.nodes()}
    if name not in specs:
        raise InputError(f"no node {name!r} in the graph; it has {', '.join(specs)}")
    folder = Path(tempfile.mkdtemp(prefix="rhythmid-"))
    extra = {"unattended": True} if name == "excitation" else {}
    line = command(specs[name], ros_arguments(specs[name], experiment.namespace, folder, extra))
    os.execve(line[0], line, run_environment(os.environ, None, folder))


@contextmanager
def interruptions() -> Iterator[Callable[[], bool]]:
    """Within the block SIGINT and SIGTERM are only noted; yields a function that returns whether one has arrived."""
    came: list[int] = []
    before = {
        number: signal.signal(number, lambda received, _frame: came.append(received))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
