"""signals.yaml: which recorded channel is what.

    time: header                      # header | receive | {column: t_ms, scale: 0.001} | {sample_rate: 610.3515625}
    input:   {topic: /hopper/excitation,   field: "effort[leg]"}
    output:  {topic: /hopper/joint_states, field: "position[leg]"}
    forcing: {topic: /hopper/forcing,      field: "effort[leg]"}
    use: [10, 90]                     # seconds of the record's time, the end excluded
    # on input: kind: force (default) | base_displacement | base_acceleration | reference; hold: zero | linear | band_limited
    # on output: kind: position (default) | velocity | acceleration
    parameters: {position_control.proportional: 12.5}      # what the model's parameters were in this record

A channel is a field of a topic, or a `column` of a `file` (.mat, .csv, .npz; relative to signals.yaml; `tables: {file: …}`
names one file for all; without either it is a column of the table that is read). `time:` may be given for a channel, too, as for
commands whose messages bear no stamp: `input: {topic: /command, field: data, time: receive}`. Its value is `scale` * recorded + `offset`, in `unit`. `input: none` says that nothing but the
forcing, if that, drives the machine. `forcing: {amplitude: 1.0, frequency: 1.0, phase: 0.0}` states
amplitude * cos(2π frequency t + phase) in the record's time. A parameter of the model that differs from record to record, such
as a controller's gain, is declared by its value, or where one file is for several records, by record:
`parameters: {position_control.proportional: {slow: 12.5, fast: 25}}`. What all records declare is not estimated.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from rhythmid.document import Node, parse, read
from rhythmid.errors import InputError
from rhythmid.record.field import Field
from rhythmid.record.heading import NOT_SI
from rhythmid.simulation.signal import Hold

InputKind = Literal["force", "base_displacement", "base_acceleration", "reference"]
OutputKind = Literal["position", "velocity", "acceleration"]
ROLES = ("input", "output", "forcing", "velocity", "effort", "reference")
UNITS = {"input": "N", "output": "m", "forcing": "N", "velocity": "m/s", "effort": "N", "reference": "m"}
INPUT_UNITS: dict[InputKind, str] = {
    "force": "N", "base_displacement": "m", "base_acceleration": "m/s^2", "reference": "m",
}  # fmt: skip
OUTPUT_UNITS: dict[OutputKind, str] = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
HOLDS: tuple[Hold, ...] = ("zero", "linear", "band_limited")


@dataclass(frozen=True)
class Clock:
    """Where times come from: `header` stamps, `receive` times, a `column` of the table, whose numbers are `scale` seconds each,
    or a sample `rate` [Hz]."""

    kind: Literal["header", "receive", "column", "rate"] = "header"
    column: str | int = ""
    rate: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True)
class Sinusoid:
    """Forcing known by formula: amplitude * cos(2π frequency [Hz] t [s] + phase [rad])."""

    amplitude: float
    frequency: float
    phase: float = 0.0

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.amplitude * np.cos(2.0 * np.pi * self.frequency * time + self.phase)


@dataclass(frozen=True)
class Source:
    """Where one channel comes from: `field` of `topic`, or `column` of `file`, None for the table that is read.

    `time` is where its times come from, None where that is as for the whole record.
    """

    unit: str
    topic: str = ""
    field: Field | None = None
    file: Path | None = None
    column: str | int = ""
    scale: float = 1.0
    offset: float = 0.0
    time: Clock | None = None
    place: str = ""  # "signals.yaml:3: input: ", to begin a complaint with

    def clock(self, usual: Clock) -> Clock:
        """Where its times come from, `usual` where it has no clock of its own."""
        return self.time or usual

    def __str__(self) -> str:
        if self.topic:
            return f"{self.topic} {self.field.text if self.field else ''}"
        return f"{self.file.name if self.file else 'table'} column {self.column}"


@dataclass(frozen=True)
class Signals:
    """Contents of a signals.yaml.

    Attributes
    ----------
    channels : role (`input`, `output`, `forcing`, `velocity`, `effort`, `reference`) -> source.
    forcing_law : the forcing where it is given by formula.
    input_kind : what the input is.
    output_kind : what the output measures; an acceleration is the mass's own, not relative to a moving base.
    hold : how the input continues between its samples; None stands for the default of its kind of record.
    use : [t0, t1) in seconds of the record's time.
    optional : roles that may be absent from the bag (the forcing of the default signals).
    parameters : values of the model's parameters in this record, by "element.parameter"; or by record's name for each.
    """

    channels: Mapping[str, Source]
    time: Clock = Clock()
    forcing_law: Sinusoid | None = None
    input_kind: InputKind = "force"
    output_kind: OutputKind = "position"
    hold: Hold | None = None
    use: tuple[float, float] = (-math.inf, math.inf)
    optional: frozenset[str] = field(default_factory=frozenset)
    path: Path | None = None
    parameters: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)

    def declared(self, record: str) -> dict[str, float]:
        """Values of the model's parameters that are declared for a record. Raises InputError where it is left out of a list."""
        found: dict[str, float] = {}
        for name, value in self.parameters.items():
            if isinstance(value, Mapping):
                if record not in value:
                    raise InputError(
                        f"{self.path}: parameters: {name}: has no value for the record {record!r}"
                    )
                value = value[record]
            found[name] = value
        return found

    @property
    def from_tables(self) -> bool:
        """Whether the channels are columns of tables, so that no bag is needed."""
        return not self.channels["output"].topic

    def of_table(self, path: Path) -> "Signals":
        """The same channels of the table at `path`, where they name no file. Raises InputError when they need no such table."""
        if not self.from_tables:
            raise InputError(f"{self.path}: names topics of a bag, but {path} is a table: name its columns")
        if all(source.file is not None for source in self.channels.values()):
            raise InputError(f"{self.path}: names its tables itself, so it takes the place of {path}")
        channels = {
            role: source if source.file is not None else replace(source, file=path)
            for role, source in self.channels.items()
        }
        return replace(self, channels=channels, path=path)

    @classmethod
    def load(cls, path: str | Path) -> "Signals":
        """The signals.yaml at `path`. Raises InputError naming line and key of what is wrong."""
        return _signals(read(path), Path(path))

    @classmethod
    def from_text(cls, text: str, path: str | Path = "signals.yaml") -> "Signals":
        """The signals in a YAML text that stands for the file `path`."""
        return _signals(parse(text, str(path)), Path(path))

    @classmethod
    def from_node(cls, document: Node, path: str | Path) -> "Signals":
        """The signals in a document that was read from the file `path`."""
        return _signals(document, Path(path))

    @classmethod
    def default(cls, namespace: str = "/hopper", joint: str = "leg") -> "Signals":
        """The topics that rhythmid's own nodes publish; the forcing may be absent."""
        topics = {"input": "excitation", "output": "joint_states", "forcing": "forcing"}
        fields = {"input": "effort", "output": "position", "forcing": "effort"}
        channels = {
            role: Source(
                UNITS[role], f"{namespace.rstrip('/')}/{topic}", Field.parse(f"{fields[role]}[{joint}]")
            )
            for role, topic in topics.items()
        }
        return cls(channels, optional=frozenset({"forcing"}))


def _signals(document: Node, path: Path) -> Signals:
    keys = document.mapping(["time", *ROLES, "use", "tables", "parameters"])
    file = _default_file(keys.get("tables"), path.parent)
    channels: dict[str, Source] = {}
    law: Sinusoid | None = None
    kind: InputKind = "force"
    hold: Hold | None = None
    measured: OutputKind = "position"
    for role in ROLES:
        if role not in keys or keys[role].value in (None, "none"):
            continue
        node = keys[role]
        options = node.mapping()
        if role == "forcing" and "amplitude" in options:
            law = _sinusoid(node)
            continue
        unit = UNITS[role]
        if role == "input":
            if "kind" in options:
                kind = cast(InputKind, options["kind"].choice(INPUT_UNITS))
            if "hold" in options:
                hold = cast(Hold, options["hold"].choice(HOLDS))
            unit = INPUT_UNITS[kind]
        if role == "output" and "kind" in options:
            measured = cast(OutputKind, options["kind"].choice(OUTPUT_UNITS))
            unit = OUTPUT_UNITS[measured]
        channels[role] = _source(node, role, unit, path.parent, file)
    if "output" not in channels:
        document.fail("'output:' is missing: which channel is the measured motion?")
    output = channels["output"]
    for role, source in channels.items():
        if bool(source.topic) != bool(output.topic):
            keys[role].fail("topics and files cannot be mixed in one record")
    if "use" in keys:
        ends = [end.number() for end in keys["use"].items()]
        if len(ends) != 2 or not ends[0] < ends[1]:
            keys["use"].fail("two times [t0, t1] in seconds are expected, t0 < t1")
        use = ends[0], ends[1]
    else:
        use = -math.inf, math.inf
    if "time" not in keys and all(source.time is not None for source in channels.values()):
        clock = Clock()
    else:
        clock = _clock(keys.get("time"), document, not output.topic)
    parameters = _parameters(keys["parameters"]) if "parameters" in keys else {}
    return Signals(channels, clock, law, kind, measured, hold, use, path=path, parameters=parameters)


def _parameters(node: Node) -> dict[str, float | Mapping[str, float]]:
    return {
        name: {record: one.number() for record, one in given.mapping().items()}
        if isinstance(given.value, dict)
        else given.number()
        for name, given in node.mapping().items()
    }


def _default_file(node: Node | None, folder: Path) -> Path | None:
    if node is None:
        return None
    keys = node.mapping(["file", "column"])
    if "column" in keys:
        keys["column"].fail("a column belongs to a channel, as in  input: {file: data.mat, column: V1}")
    if "file" not in keys:
        node.fail("'file:' is missing")
    return folder / keys["file"].text()


def _source(node: Node, role: str, unit: str, folder: Path, default_file: Path | None) -> Source:
    known = ["topic", "field", "file", "column", "time", "unit", "scale", "offset"]
    more = {"input": ["kind", "hold"], "output": ["kind"]}.get(role, [])
    keys = node.mapping([*known, *more])
    if "unit" in keys:
        unit = keys["unit"].text()
        if unit in NOT_SI:
            factor, si = NOT_SI[unit]
            keys["unit"].fail(f"{unit} is not an SI unit: write  scale: {factor:.10g}, unit: {si}")
    scale = keys["scale"].number() if "scale" in keys else 1.0
    offset = keys["offset"].number() if "offset" in keys else 0.0
    if scale == 0.0 or not math.isfinite(scale) or not math.isfinite(offset):
        node.fail("scale must be finite and other than 0, offset finite")
    place = f"{node.place}: {role}: "
    clock = _clock(keys["time"], node, "topic" not in keys) if "time" in keys else None
    if "topic" in keys:
        if "file" in keys or "column" in keys:
            node.fail("give either topic and field, or file and column")
        if "field" not in keys:
            node.fail("'field:' is missing, such as  field: position[leg]  or  field: wrench.force.z")
        topic = keys["topic"].text()
        try:
            wanted = Field.parse(str(keys["field"].value))
        except InputError as error:
            keys["field"].fail(str(error))
        return Source(
            unit, "/" + topic.lstrip("/"), wanted, scale=scale, offset=offset, time=clock, place=place
        )
    if "field" in keys:
        node.fail("'topic:' is missing: whose field is it?")
    if "column" not in keys:
        node.fail("give topic and field (of a bag) or file and column (of a .mat, .csv or .npz table)")
    file = folder / keys["file"].text() if "file" in keys else default_file
    column = _column(keys["column"])
    return Source(unit, file=file, column=column, scale=scale, offset=offset, time=clock, place=place)


def _column(node: Node) -> str | int:
    if isinstance(node.value, bool) or not isinstance(node.value, (str, int)):
        node.fail("a column's name, or its number counted from 0, is expected")
    return node.value


def _sinusoid(node: Node) -> Sinusoid:
    keys = node.mapping(["amplitude", "frequency", "phase"])
    if "frequency" not in keys:
        node.fail("'frequency:' [Hz] is missing")
    phase = keys["phase"].number(-1e6, 1e6) if "phase" in keys else 0.0
    return Sinusoid(keys["amplitude"].number(-1e12, 1e12), keys["frequency"].number(1e-9, 1e9), phase)


def _clock(node: Node | None, document: Node, tables: bool) -> Clock:
    if node is None:
        if tables:
            document.fail("'time:' is missing; for a table it is {sample_rate: 1000} in Hz or {column: t}")
        return Clock()
    if isinstance(node.value, dict):
        keys = node.mapping(["column", "scale", "sample_rate"])
        if not tables:
            node.fail(
                "column and sample_rate are for tables; the messages of a bag have times: header or receive"
            )
        if ("column" in keys) == ("sample_rate" in keys) or {"scale", "sample_rate"} <= keys.keys():
            node.fail("either sample_rate, or column and perhaps its scale [s], is expected")
        if "column" in keys:
            scale = keys["scale"].number(1e-12, 1e6) if "scale" in keys else 1.0
            return Clock("column", column=_column(keys["column"]), scale=scale)
        return Clock("rate", rate=keys["sample_rate"].number(1e-6, 1e12))
    kind = node.choice(["header", "receive"])
    if tables:
        node.fail("a table has no message times: give {sample_rate: 1000} in Hz or {column: t}")
    return Clock("receive" if kind == "receive" else "header")
