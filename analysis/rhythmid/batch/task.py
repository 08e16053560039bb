"""The tasks of a batch: one answer each, with a key that changes with everything on which the answer depends."""

import glob
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from itertools import product
from os.path import relpath
from pathlib import Path

from rhythmid import __version__
from rhythmid.batch.fingerprint import Fingerprint
from rhythmid.batch.manifest import Command, DiagnoseOptions, IdentifyOptions, Manifest, Options, Settled
from rhythmid.body.machine import Machine, describes_machine
from rhythmid.document import Node, read
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.record.joint_record import JointSignals
from rhythmid.record.signals import Signals

DIGITS = 12  # of a key in a file's name: 48 bits, enough for thousands of answers
LONGEST_TASK_NAME = 60  # characters of a task's name in a file's name


@dataclass(frozen=True)
class Task:
    """One answer to be computed.

    Attributes
    ----------
    name : the recording, then the joint and whatever distinguishes it from other answers to the same recording; for people.
    bag : the recording as found by the manifest; recordings that are analysed together are joined by " + ".
    group : the rig, or what else recordings are compared by.
    sources, holdout : recordings to analyse, and held-out recordings.
    model, signals, joint, elements : as for the command; `machine` if the model has several joints.
    labels : names of model and signals in the manifest; their paths where one name stands for different files.
    key : digest of everything on which the answer depends.
    """

    name: str
    bag: str
    group: str
    command: Command
    sources: tuple[Path, ...]
    holdout: tuple[Path, ...]
    model: Path | None
    machine: bool
    signals: Path | None
    joint: str | None
    elements: tuple[Path, ...]
    labels: tuple[str, str]
    options: Options
    key: str = ""

    def __repr__(self) -> str:
        """Short, because tasks are the keys of mappings that people print."""
        return f"Task({self.name!r}, {self.command!r})"

    @property
    def variant(self) -> str:
        """Options of an identification that differ from the defaults, in words. Answers that differ in these options are not compared."""
        if not isinstance(self.options, IdentifyOptions):
            return ""
        usual = asdict(IdentifyOptions())
        said = {name: value for name, value in asdict(self.options).items() if value != usual[name]}
        return ", ".join(f"{name} {value}" for name, value in said.items())

    @property
    def file(self) -> str:
        """Name of its answer's files, without suffix."""
        plain = re.sub(r"[^A-Za-z0-9]+", "-", self.name).strip("-")[:LONGEST_TASK_NAME].strip("-")
        return f"{plain or 'answer'}-{self.key[:DIGITS]}"


def tasks_of(manifest: Manifest) -> tuple[Task, ...]:
    """The tasks of a manifest, in its order.

    Raises InputError naming the line where a glob matches nothing, a model or signals file is wrong, or the same answer is asked for twice.
    """
    found: dict[str, Task] = {}
    check, fingerprint = lru_cache(maxsize=None)(_joints_of), Fingerprint(manifest.folder)
    for settled in manifest.entries:
        for unkeyed in _tasks(settled, manifest.folder, check):
            task = replace(unkeyed, key=_key(unkeyed, fingerprint))
            if task.key in found:
                settled.place.fail(f"asks for {task.name} a second time, with the same files and options")
            found[task.key] = task
    return _named(_distinct(tuple(found.values()), manifest.folder))


def _distinct(tasks: tuple[Task, ...], folder: Path) -> tuple[Task, ...]:
    """The tasks with different labels for different models and signals, whatever their files are called."""
    models = _by_content([(task.labels[0], task.model, task.machine) for task in tasks], folder)
    signals = _by_content([(task.labels[1], task.signals, False) for task in tasks], folder)
    return tuple(replace(task, labels=pair) for task, pair in zip(tasks, zip(models, signals)))


def _by_content(named: Sequence[tuple[str, Path | None, bool]], folder: Path) -> list[str]:
    """A label for each named file: its name, or its path where the name is that of files of different content.

    A name that the manifest gives a file remains: it says which files are to be taken for the same. A model of several joints
    refers to other files by paths relative to its own, so that its path counts, not its content.
    """
    known: dict[str, dict[object, Path]] = {}
    contents: list[object] = []
    read_bytes = lru_cache(maxsize=None)(Path.read_bytes)
    for name, path, whole in named:
        content = None if path is None else path.resolve() if whole else read_bytes(path)
        contents.append(content)
        if path is not None and name == path.stem:
            known.setdefault(name, {}).setdefault(content, path)
    return [
        relpath(known[name][content], folder)
        if len(known.get(name, ())) > 1 and content in known[name]
        else name
        for (name, _, _), content in zip(named, contents)
    ]


def _named(tasks: tuple[Task, ...]) -> tuple[Task, ...]:
    """The tasks with command, model, signals and options in their names, as far as the batch has several of them."""

    def labels(task: Task) -> tuple[str, ...]:
        return (task.command, *task.labels, task.variant)

    several = [len(set(one)) > 1 for one in zip(*map(labels, tasks))]
    return tuple(
        replace(
            task,
            name=" · ".join([task.name, *(one for one, many in zip(labels(task), several) if many and one)]),
        )
        for task in tasks
    )


def _tasks(
    settled: Settled, folder: Path, joints_of: Callable[..., tuple[bool, tuple[str, ...]]]
) -> Iterable[Task]:
    entry, command, options = settled.entry, settled.command, settled.options
    bags = _matches(entry.bags, folder, settled.place.at("bags"))
    holdout: tuple[Path, ...] = ()
    if isinstance(options, DiagnoseOptions) and options.holdout:
        holdout = _matches(options.holdout, folder, settled.place)
    elements = tuple(folder / one for one in entry.elements or ())
    models = _paths(entry.model if command != "check" else None, folder)
    signals = _paths(entry.signals, folder)
    rest = tuple(bag for bag in bags if bag not in holdout)
    if not rest:
        settled.place.fail("every recording is held out; name others in 'bags:'")
    sources = [rest] if entry.together else [(bag,) for bag in rest]
    for own, (model_name, model), (signals_name, file) in product(sources, models.items(), signals.items()):
        machine, known = joints_of(model, file, elements)
        if entry.joints and not known:
            settled.place.fail("'joints:' is for signals files with joints; name one in 'signals:'")
        joints = (None,) if machine or not known else tuple(entry.joints or known)
        for joint in joints:
            if joint is not None and joint not in known:
                settled.place.at("joints").fail(f"{joint!r} is none of {file}: {', '.join(known)}")
            bag = " + ".join(relpath(one, folder) for one in own)
            name = f"{bag} · {joint}" if joint else bag
            yield Task(
                name, bag, entry.group or "", command, own, holdout, model, machine, file, joint, elements,
                (model_name, signals_name), options,
            )  # fmt: skip


def _matches(patterns: Iterable[str], folder: Path, place: Node) -> tuple[Path, ...]:
    """Recordings that the globs find, each once, in the order of the globs and of their names, numbers by their size."""
    found: dict[Path, None] = {}
    for pattern in patterns:
        matches = sorted(glob.glob(pattern, root_dir=folder, recursive=True), key=_natural)
        if not matches:
            place.fail(f"{pattern!r} matches nothing in {folder}; a glob is relative to the manifest")
        found |= dict.fromkeys(folder / match for match in matches)
    return tuple(found)


def _natural(name: str) -> list[str | int]:
    """Key of the order in which run6 comes before run11: the numbers in a name count as numbers."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]


def _paths(named: Mapping[str, str] | None, folder: Path) -> dict[str, Path | None]:
    return {"": None} if named is None else {name: folder / path for name, path in named.items()}


def _joints_of(
    model: Path | None, signals: Path | None, elements: tuple[Path, ...]
) -> tuple[bool, tuple[str, ...]]:
    """Whether the model is one of several joints, and the joints of the signals file; both files are read to see that they can be.

    Raises InputError as the files' readers do.
    """
    machine = model is not None and describes_machine(model)
    if model is not None:
        loaded(model, machine, load_catalogue(elements))
    if signals is None:
        if machine:
            raise InputError(f"{model}: a model of several joints needs 'signals:' with  joints: [hip, knee]")
        return machine, ()
    if "joints" in read(signals).mapping():
        return machine, tuple(JointSignals.load(signals).joints)
    Signals.load(signals)
    return machine, ()


def loaded(model: Path, machine: bool, catalogue: Catalogue) -> Model | Machine:
    """The model in a file."""
    return Machine.load(model, catalogue) if machine else Model.load(model, catalogue)


def _key(task: Task, fingerprint: Fingerprint) -> str:
    """Group and labels are left out, because they are not in the answer."""
    options = [__version__, task.command, task.joint, asdict(task.options), len(task.sources)]
    texts = [path for path in (task.model, task.signals) if path is not None]
    texts += [file for folder in task.elements for file in sorted(folder.rglob("*.py"))]
    return fingerprint(options, texts, (*task.sources, *task.holdout))
