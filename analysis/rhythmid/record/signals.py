"""signals.yaml: mapping of recorded channels to roles.

    time: header                      # header | sent | receive | {column: t_ms, scale: 0.001} | {sample_rate: 610.3515625}
    input:   {topic: /hopper/excitation,   field: "effort[leg]"}
    output:  {topic: /hopper/joint_states, field: "position[leg]"}
    forcing: {topic: /hopper/forcing,      field: "effort[leg]"}
    use: [10, 90]                     # seconds of the record's time, the end excluded; or by record: {slow: [10, 90], fast: [2, 40]}
    # on input: kind: force (default) | base_displacement | base_acceleration | reference; hold: zero | linear | band_limited
    # on output: kind: position (default) | velocity | acceleration
    parameters: {position_control.proportional: 12.5}      # what the model's parameters were in this record

A channel is a field of a topic, or a `column` of a `file` (.mat, .csv, .npz; relative to signals.yaml). `tables:
{file: …}` names one file for all channels; without a file it is a column of the table that is read. `time:` may
also be given for a single channel, for example for commands without stamps: `input: {topic: /command, field: data, time: sent}`.
A channel's value is `scale` * recorded + `offset`, in `unit`; the offset of an encoder that is zeroed before each
recording is given by record: `offset: {slow: 0, fast: 3.14}`. `sign_bit: 15` says that bit 15 of the recorded word is its sign.
`input: none` declares that at most the forcing drives the machine. `forcing: {amplitude: 1.0, frequency: 1.0, phase: 0.0}` states
amplitude * cos(2π frequency t + phase) in the record's time. A model parameter with a different value in each record, such as a
controller's gain, is declared by its value. If one file is used for several records, it is declared by record:
`parameters: {position_control.proportional: {slow: 12.5, fast: 25}}`. One that all records declare is not estimated.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Discriminator, Tag, TypeAdapter
from pydantic import Field as Limits

from rhythmid.document import Node, parse, read
from rhythmid.errors import InputError
from rhythmid.record.field import Field
from rhythmid.simulation.signal import Hold
from rhythmid.units import is_readable, multiple_of_si
from rhythmid.validation import ByShape, InKeys, Number, Plain, Range, Word, validated

InputKind = Literal["force", "base_displacement", "base_acceleration", "reference"]
OutputKind = Literal["position", "velocity", "acceleration"]
ROLES = ("input", "output", "forcing", "velocity", "effort", "reference")
UNITS = {"input": "N", "output": "m", "forcing": "N", "velocity": "m/s", "effort": "N", "reference": "m"}
INPUT_UNITS: dict[InputKind, str] = {
    "force": "N", "base_displacement": "m", "base_acceleration": "m/s^2", "reference": "m",
}  # fmt: skip
OUTPUT_UNITS: dict[OutputKind, str] = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
KEYS = ConfigDict(extra="forbid")
Part = tuple[float, float]  # start and end [s] of a part of a record
WHOLE: Part = (-math.inf, math.inf)
BagClock = Literal["header", "sent", "receive"]
BAG_CLOCKS: tuple[BagClock, ...] = get_args(BagClock)


@dataclass(frozen=True)
class Clock:
    """Source of times: `header` stamps, times at which messages were `sent`, `receive` times, a `column` of the table with numbers in units of `scale`
    seconds, or a sample `rate` [Hz]."""

    kind: BagClock | Literal["column", "rate"] = "header"
    column: str | int = ""
    rate: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True)
class Sinusoid:
    """Forcing by formula: amplitude * cos(2π frequency [Hz] t [s] + phase [rad])."""

    __pydantic_config__ = KEYS
    amplitude: Annotated[Number, Limits(ge=-1e12, le=1e12)]
    frequency: Annotated[Number, Limits(ge=1e-9, le=1e9)]
    phase: Annotated[Number, Limits(ge=-1e6, le=1e6)] = 0.0

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.amplitude * np.cos(2.0 * np.pi * self.frequency * time + self.phase)


@dataclass(frozen=True)
class Source:
    """Source of one channel: `field` of `topic`, or `column` of `file`, None for the table that is read.

    `time` is the source of its times, None for that of the whole record. `sign_bit` is the place of the bit that is
    the sign of the recorded word, None where it is an ordinary number.
    """

    unit: str
    topic: str = ""
    field: Field | None = None
    file: Path | None = None
    column: str | int = ""
    scale: float = 1.0
    offset: float | Mapping[str, float] = 0.0  # for several records, by record name
    sign_bit: int | None = None
    time: Clock | None = None
    place: str = ""  # "signals.yaml:3: input: ", as the start of a message

    def clock(self, usual: Clock) -> Clock:
        """Source of its times: its own clock, else `usual`."""
        return self.time or usual

    def of_record(self, record: str) -> "Source":
        """The source with the offset of one record. Raises InputError where offsets by record lack it."""
        if not isinstance(self.offset, Mapping):
            return self
        if record not in self.offset:
            raise InputError(
                f"{self.place}offset: has no value for {record!r}, only for {', '.join(self.offset)}"
            )
        return replace(self, offset=self.offset[record])

    @property
    def one_offset(self) -> float:
        """The offset. Raises InputError where it differs by record and the record is not known, as on a live topic."""
        if isinstance(self.offset, Mapping):
            raise InputError(f"{self.place}offset: one number is needed here, not one for each record")
        return self.offset

    def __str__(self) -> str:
        if self.topic:
            return f"{self.topic} {self.field.text if self.field else ''}"
        return f"{self.file.name if self.file else 'table'} column {self.column}"


@dataclass(frozen=True)
class Signals:
    """Content of a signals.yaml.

    Attributes
    ----------
    channels : role (`input`, `output`, `forcing`, `velocity`, `effort`, `reference`) -> source.
    forcing_law : the forcing, where it is given by a formula.
    input_kind : kind of the input.
    output_kind : kind of the output; an acceleration is absolute, not relative to a moving base.
    hold : interpolation of the input between its samples; None for the default of its kind of record.
    use : [t0, t1) in seconds of the record's time; for several records, by record name.
    optional : roles that may be absent from the bag (the forcing of the default signals).
    parameters : values of the model's parameters in this record, by "element.parameter"; for several records, by
        record name.
    """

    channels: Mapping[str, Source]
    time: Clock = Clock()
    forcing_law: Sinusoid | None = None
    input_kind: InputKind = "force"
    output_kind: OutputKind = "position"
    hold: Hold | None = None
    use: Part | Mapping[str, Part] = WHOLE
    optional: frozenset[str] = field(default_factory=frozenset)
    path: Path | None = None
    parameters: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)

    def declared(self, record: str) -> dict[str, float]:
        """Values of the model's parameters that are declared for a record. Raises InputError where a list by record
        lacks this one."""
        found: dict[str, float] = {}
        for name, value in self.parameters.items():
            if isinstance(value, Mapping):
                if record not in value:
                    raise InputError(f"{self.path}: {name} has no value for the record {record!r}")
                value = value[record]
            found[name] = value
        return found

    def of_record(self, record: str) -> "Signals":
        """The same channels with the offsets of one record. Raises InputError where offsets by record lack this one."""
        return replace(self, channels={role: one.of_record(record) for role, one in self.channels.items()})

    def part(self, record: str) -> Part:
        """The part of a record that is used. Raises InputError where the parts by record lack this one."""
        if not isinstance(self.use, Mapping):
            return self.use
        if record not in self.use:
            raise InputError(
                f"{self.path}: use: has no part of the record {record!r}, only of {', '.join(self.use)}; write  {record}: [0, 60]  there, in s"
            )
        return self.use[record]

    @property
    def from_tables(self) -> bool:
        """Whether the channels are columns of tables, so that no bag is needed."""
        return not self.channels["output"].topic

    def of_table(self, path: Path) -> "Signals":
        """The same channels in the table at `path`, where they name no file. Raises InputError when they need no
        such table."""
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
        """The signals.yaml at `path`. Raises InputError with line and key of an error."""
        return _signals(read(path), Path(path))

    @classmethod
    def from_text(cls, text: str, path: str | Path = "signals.yaml") -> "Signals":
        """The signals in a YAML text; `path` is the file name used in messages."""
        return _signals(parse(text, str(path)), Path(path))

    @classmethod
    def from_node(cls, document: Node, path: str | Path) -> "Signals":
        """The signals in a document read from the file `path`."""
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


def _column(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise ValueError("a column's name, or its number counted from 0, is expected")
    return value


def _of_si(unit: str) -> str:
    if (known := multiple_of_si(unit)) is not None:
        factor, si = known
        raise ValueError(f"{unit} is not an SI unit: write  scale: {factor:.10g}, unit: {si}")
    if not is_readable(unit):
        raise ValueError(f"{unit!r} cannot be read as a unit: write it like  rad, N*m, m/s^2, V  or  px")
    return unit


def _some(scale: float) -> float:
    if scale == 0.0:
        raise ValueError("a scale is other than 0")
    return scale


def _of_a_channel(_: Any) -> None:
    raise ValueError("a column belongs to a channel, as in  input: {file: data.mat, column: V1}")


Column = Annotated[str | int, BeforeValidator(_column)]
ByRecord = Annotated[Annotated[dict[Word, Number], InKeys] | Annotated[Number, Plain], ByShape]


@dataclass(frozen=True)
class _Clock:
    __pydantic_config__ = KEYS
    column: Column | None = None
    scale: Annotated[Number, Limits(ge=1e-12, le=1e6)] | None = None
    sample_rate: Annotated[Number, Limits(ge=1e-6, le=1e12)] | None = None


AnyClock = Annotated[Annotated[_Clock, InKeys] | Annotated[BagClock, Plain], ByShape]


@dataclass(frozen=True)
class _Channel:
    """A channel as written in the file."""

    __pydantic_config__ = KEYS
    topic: str | None = None
    field: Annotated[str, BeforeValidator(str)] | None = None
    file: str | None = None
    column: Column | None = None
    time: AnyClock | None = None
    unit: Annotated[str, AfterValidator(_of_si)] | None = None
    scale: Annotated[Number, AfterValidator(_some)] = 1.0
    offset: ByRecord = 0.0
    sign_bit: Annotated[int, Limits(ge=1, le=63)] | None = None


@dataclass(frozen=True)
class _Input(_Channel):
    kind: InputKind = "force"
    hold: Hold | None = None


@dataclass(frozen=True)
class _Output(_Channel):
    kind: OutputKind = "position"


@dataclass(frozen=True)
class _Tables:
    __pydantic_config__ = KEYS
    file: str
    column: Annotated[Any, BeforeValidator(_of_a_channel)] = None


def _of_forcing(value: Any) -> str:
    return "formula" if isinstance(value, Mapping) and "amplitude" in value else "channel"


def _not_none(value: Any) -> Any:
    return None if value == "none" else value


AnyForcing = Annotated[
    Annotated[Sinusoid, Tag("formula")] | Annotated[_Channel, Tag("channel")], Discriminator(_of_forcing)
]
Absent = BeforeValidator(_not_none)


@dataclass(frozen=True)
class _Document:
    """signals.yaml as written."""

    __pydantic_config__ = KEYS
    time: AnyClock | None = None
    input: Annotated[_Input | None, Absent] = None
    output: Annotated[_Output | None, Absent] = None
    forcing: Annotated[AnyForcing | None, Absent] = None
    velocity: Annotated[_Channel | None, Absent] = None
    effort: Annotated[_Channel | None, Absent] = None
    reference: Annotated[_Channel | None, Absent] = None
    use: Annotated[Annotated[dict[Word, Range], InKeys] | Annotated[Range, Plain], ByShape] = WHOLE
    tables: _Tables | None = None
    parameters: dict[str, ByRecord] = field(default_factory=dict)


_DOCUMENT: TypeAdapter[_Document] = TypeAdapter(_Document)


def _signals(document: Node, path: Path) -> Signals:
    given = validated(document, _DOCUMENT)
    file = None if given.tables is None else path.parent / given.tables.file
    kind: InputKind = "force" if given.input is None else given.input.kind
    measured: OutputKind = "position" if given.output is None else given.output.kind
    units = UNITS | {"input": INPUT_UNITS[kind], "output": OUTPUT_UNITS[measured]}
    channels = {
        role: _source(document.at(role), role, channel, units[role], path.parent, file)
        for role in ROLES
        if isinstance(channel := getattr(given, role), _Channel)
    }
    if "output" not in channels:
        document.fail("'output:' is missing: which channel is the measured motion?")
    output = channels["output"]
    for role, source in channels.items():
        if bool(source.topic) != bool(output.topic):
            document.at(role).fail("topics and files cannot be mixed in one record")
    clock = Clock()
    if given.time is not None:
        clock = _clock(document.at("time"), given.time, not output.topic)
    elif not output.topic and any(source.time is None for source in channels.values()):
        document.fail("'time:' is missing; for a table it is {sample_rate: 1000} in Hz or {column: t}")
    law = given.forcing if isinstance(given.forcing, Sinusoid) else None
    hold = None if given.input is None else given.input.hold
    own = given.parameters
    return Signals(channels, clock, law, kind, measured, hold, given.use, path=path, parameters=own)


def _source(
    node: Node, role: str, given: _Channel, unit: str, folder: Path, default_file: Path | None
) -> Source:
    made = Source(
        given.unit or unit, scale=given.scale, offset=given.offset, sign_bit=given.sign_bit, place=f"{node.place}: {role}: ",
        time=None if given.time is None else _clock(node.at("time"), given.time, given.topic is None),
    )  # fmt: skip
    if given.topic is not None:
        if given.file is not None or given.column is not None:
            node.fail("give either topic and field, or file and column")
        if given.field is None:
            node.fail("'field:' is missing, such as  field: position[leg]  or  field: wrench.force.z")
        try:
            wanted = Field.parse(given.field)
        except InputError as error:
            node.at("field").fail(str(error))
        return replace(made, topic="/" + given.topic.lstrip("/"), field=wanted)
    if given.field is not None:
        node.fail("'topic:' is missing: whose field is it?")
    if given.column is None:
        node.fail("give topic and field (of a bag) or file and column (of a .mat, .csv or .npz table)")
    return replace(made, file=folder / given.file if given.file else default_file, column=given.column)


def _clock(node: Node, given: _Clock | BagClock, tables: bool) -> Clock:
    if isinstance(given, str):
        if tables:
            node.fail("a table has no message times: give {sample_rate: 1000} in Hz or {column: t}")
        return Clock(given)
    if not tables:
        node.fail(
            f"column and sample_rate are for tables; a bag's messages have times: {', '.join(BAG_CLOCKS)}"
        )
    if given.column is not None and given.sample_rate is None:
        return Clock("column", column=given.column, scale=1.0 if given.scale is None else given.scale)
    if given.sample_rate is None or given.column is not None or given.scale is not None:
        node.fail("either sample_rate, or column and perhaps its scale [s], is expected")
    return Clock("rate", rate=given.sample_rate)
