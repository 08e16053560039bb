"""Records of machines with several joints: a record for each joint, from one recording.

A signals.yaml with `joints:` maps the channels of all joints at once:

    joints: [hip, knee]                               # or {hip: left_hip, …}: the recording's own names
    input:  {topic: /cmd, field: "position[*]", feedforward: "effort[*]"}
    output: {topic: /joint_states, field: "position[*]"}
    effort: {field: "effort[*]", taken: before_actuator, sampled: mean}   # or after_actuator; or instant
    base:   {field: "position[rail]"}                 # where the body's base moves along a joint

A channel's `scale` holds for all joints, or is given by joint: `scale: {knee: -1}`; joints that are not named have
scale 1. `[*]` stands for each joint's name in a bag and for its index in a table's array (`column: "q[*]"`).
Elsewhere in a column's name `*` stands for the joint's name (`column: "q_*"`); a list has the column of each joint
(`column: [1, 2]`). A channel without topic or file
takes the output's. A command that is a position is a reference for the controllers, see `kind` in the signals.yaml
of one axis; `feedforward` is a force that the controllers add.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import TypeAdapter

from rhythmid.document import Node, parse, read
from rhythmid.errors import InputError
from rhythmid.record.opened import Opened
from rhythmid.record.read import read_record, read_tables
from rhythmid.record.record import Record
from rhythmid.record.signals import Signals
from rhythmid.validation import validated

Taken = Literal["before_actuator", "after_actuator"]
Sampled = Literal["mean", "instant"]
_TAKEN: TypeAdapter[Taken] = TypeAdapter(Taken)
_SAMPLED: TypeAdapter[Sampled] = TypeAdapter(Sampled)
_TEXT: TypeAdapter[str] = TypeAdapter(str)
SHARED = ("topic", "file", "time")  # keys that a channel takes from the output by default


@dataclass(frozen=True)
class JointSignals:
    """Content of a signals.yaml with `joints:`, as signals of each single joint.

    `base` holds the signals of the base's joint. `sampled` says whether an effort is the mean over a sample period or
    instantaneous, where that is declared.
    """

    joints: Mapping[str, Signals]
    base: Signals | None
    taken: Taken
    path: Path
    sampled: Sampled | None = None

    @classmethod
    def load(cls, path: str | Path) -> "JointSignals":
        """The signals.yaml at `path`. Raises InputError with line and key of an error."""
        return _joint_signals(read(path), Path(path))

    @classmethod
    def from_text(cls, text: str, path: str | Path = "signals.yaml") -> "JointSignals":
        """The signals in a YAML text; `path` is the file name used in messages."""
        return _joint_signals(parse(text, str(path)), Path(path))


@dataclass(frozen=True, eq=False)
class JointRecord:
    """One recording of a machine: a record for each joint, and one of the base's joint where the base moves along
    one. All times have the same zero. `scales` are those that the signals state, by role and joint."""

    name: str
    joints: Mapping[str, Record]
    base: Record | None = None
    taken: Taken = "before_actuator"
    sampled: Sampled | None = None
    scales: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])

    @property
    def every(self) -> dict[str, Record]:
        """The record of every joint, and of the base as `base`."""
        return dict(self.joints) if self.base is None else {**self.joints, "base": self.base}

    def cut(self, start: float, end: float) -> "JointRecord":
        """The part within [start, end) seconds."""
        joints = {name: record.cut(start, end) for name, record in self.joints.items()}
        return replace(self, joints=joints, base=None if self.base is None else self.base.cut(start, end))

    def in_rad(self, turning: Collection[str]) -> "JointRecord":
        """The record with the positions of `turning` joints, of which "base" is the base's, in rad: signals seldom state the unit of a joint."""
        made = {name: _in_rad(one) if name in turning else one for name, one in self.every.items()}
        base = None if self.base is None else made.pop("base")
        return replace(self, joints=made, base=base)

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s] at which the positions of all joints are recorded."""
        times = [record.output.time for record in self.joints.values()]
        return max(float(one[0]) for one in times), min(float(one[-1]) for one in times)


def _in_rad(record: Record) -> Record:
    roles = ["output", "reference", *(["input"] if record.input_kind == "reference" else [])]
    told = {role: one for role in roles if (one := getattr(record, role)) is not None}
    return replace(record, **{role: replace(one, unit="rad") for role, one in told.items()})


def names_joints(signals: str | Path) -> bool:
    """Whether a signals.yaml is for several joints. Raises InputError where it cannot be read."""
    value = read(signals).value
    return isinstance(value, dict) and "joints" in value


def load_joint_records(paths: Iterable[str | Path], signals: JointSignals | str | Path) -> list[JointRecord]:
    """Read several recordings. Raises InputError as `read_record` does."""
    known = signals if isinstance(signals, JointSignals) else JointSignals.load(signals)
    return [read_joint_record(path, known) for path in paths]


def joint_records(paths: Iterable[str | Path], signals: str | Path | None) -> list[JointRecord]:
    """The recordings whose signals, or whose own paths, name joints. Raises InputError as `read_record` does."""
    named = [(path, signals or path) for path in paths]
    return [
        read_joint_record(path, JointSignals.load(own))
        for path, own in named
        if Path(own).suffix in (".yaml", ".yml") and names_joints(own)
    ]


def read_joint_record(source: str | Path, signals: JointSignals) -> JointRecord:
    """Read one recording: a bag, or a table whose columns the signals name. A signals.yaml that names its tables is
    its own source."""
    opened = Opened.of([*signals.joints.values(), *([] if signals.base is None else [signals.base])])
    found = {joint: _read(source, one, signals.path, opened) for joint, one in signals.joints.items()}
    base = None if signals.base is None else _read(source, signals.base, signals.path, opened)
    scales: dict[str, dict[str, float]] = {}
    for joint, one in signals.joints.items():
        for role, channel in one.channels.items():
            scales.setdefault(role, {})[joint] = channel.scale
    name = next(iter(found.values())).name
    return JointRecord(name, found, base, signals.taken, signals.sampled, scales)


def _read(source: str | Path, signals: Signals, path: Path, opened: Opened) -> Record:
    same = Path(source).resolve() == path.resolve()
    record = read_tables(signals, opened) if same else read_record(source, signals, opened)
    # with several joints, one that stands still contributes nothing by its effort alone
    if np.ptp(record.output.value) == 0.0:
        raise InputError(f"{record.name}: {record.output.source} never changes; nothing is learnt from it")
    return record


def _joint_signals(document: Node, path: Path) -> JointSignals:
    keys = dict(document.mapping())
    if "joints" not in keys:
        document.fail("'joints:' is missing; a machine of several joints needs  joints: [hip, knee]")
    names = _names(keys.pop("joints"))
    base = keys.pop("base", None)
    output = keys.get("output")
    if output is None:
        document.fail("'output:' is missing: which channel is the measured motion?")
    taken: Taken = "before_actuator"
    sampled: Sampled | None = None
    if "effort" in keys:
        options = dict(keys["effort"].mapping())
        if "taken" in options:
            taken = validated(options.pop("taken"), _TAKEN)
        if "sampled" in options:
            sampled = validated(options.pop("sampled"), _SAMPLED)
        keys["effort"] = replace(keys["effort"], value=options)
    if "input" in keys and isinstance(keys["input"].value, dict):
        options = dict(keys["input"].value)
        if "feedforward" in options:
            field = options.pop("feedforward")
            others = {name: one for name, one in options.items() if name in SHARED}
            keys["forcing"] = replace(field, value={"field": field, **others})
        if "kind" not in options and str(getattr(options.get("field"), "value", "")).startswith("position"):
            options["kind"] = replace(keys["input"], value="reference")
        keys["input"] = replace(keys["input"], value=options)
    for role, node in keys.items():
        if role not in ("output", "time", "use", "tables", "parameters") and isinstance(node.value, dict):
            keys[role] = _with_shared(node, output)
    for role in ("input", "forcing", "output", "effort"):
        _check_scale(keys.get(role), names)
        _check_columns(keys.get(role), names)
    whole = replace(document, value=keys)
    found = {
        joint: Signals.from_node(_for_joint(whole, joint, own, place), path)
        for place, (joint, own) in enumerate(names.items())
    }
    of_base = None
    if base is not None:
        kept = {name: one for name, one in keys.items() if name in ("time", "use", "tables")}
        measured = replace(document, value={**kept, "output": _with_shared(base, output)})
        of_base = Signals.from_node(measured, path)
    return JointSignals(found, of_base, taken, path, sampled)


def _names(node: Node) -> dict[str, str]:
    """Names of the joints in the recording, by their names in the model."""
    if isinstance(node.value, dict):
        found = {name: validated(one, _TEXT) for name, one in node.mapping().items()}
    else:
        listed = [validated(one, _TEXT) for one in node.items()]
        if len(set(listed)) < len(listed):
            node.fail("names a joint twice")
        found = {name: name for name in listed}
    if not found:
        node.fail("names no joint; write  joints: [hip, knee]")
    return found


def _with_shared(node: Node, output: Node) -> Node:
    """A channel with the output's topic, file and time where it states none."""
    options, usual = node.mapping(), output.mapping()
    if "topic" in options or "file" in options:
        return node
    return replace(node, value={**{name: usual[name] for name in SHARED if name in usual}, **options})


def _check_scale(channel: Node | None, names: Iterable[str]) -> None:
    """Raise InputError where a channel has a scale for a name that is no joint."""
    scale = channel.value.get("scale") if channel is not None and isinstance(channel.value, dict) else None
    if scale is not None and isinstance(scale.value, dict):
        for joint, one in scale.value.items():
            if joint not in names:
                one.fail(f"is no joint; those are {', '.join(names)}")


def _check_columns(channel: Node | None, names: Collection[str]) -> None:
    """Raise InputError where a channel lists more or fewer columns than there are joints, or one twice."""
    column = channel.value.get("column") if channel is not None and isinstance(channel.value, dict) else None
    if column is None or not isinstance(column.value, list):
        return
    if len(column.value) != len(names):
        column.fail(
            f"lists {len(column.value)} columns of {len(names)} joints; give each joint one, in the order of 'joints:'"
        )
    listed = [one.value for one in column.value]
    if twice := [one for one in listed if listed.count(one) > 1]:
        column.fail(f"lists {twice[0]} for more than one joint; give each joint a column of its own")


def _for_joint(node: Node, joint: str, own: str, place: int) -> Node:
    """The document with `own`, the joint's name in the recording, inserted for every star but those of units, and with the values that are
    given for `joint` by its name in the model."""
    if isinstance(node.value, dict) and node.path.endswith("scale"):
        said = node.value.get(joint)
        return replace(node, value=1.0) if said is None else said
    if isinstance(node.value, dict):
        made = {key: _for_joint(one, joint, own, place) for key, one in node.value.items()}
        return replace(node, value=made)
    if isinstance(node.value, list) and node.path.endswith("column"):
        return node.value[place]
    if isinstance(node.value, list):
        return replace(node, value=[_for_joint(one, joint, own, place) for one in node.value])
    if not isinstance(node.value, str) or "*" not in node.value or node.path.endswith("unit"):
        return node
    column = node.path.endswith("column")
    text = node.value.replace("[*]", f"[{place}]" if column else f"[{own}]")
    return replace(node, value=text.replace("*", own))
