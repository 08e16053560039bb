"""Fields of a bag's messages as arrays: read by layout where all messages of a block have the same layout,
otherwise one by one."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError

from rhythmid.errors import InputError
from rhythmid.record.block import Block, Topic
from rhythmid.record.field import Field
from rhythmid.record.layout import Layout, Unsupported, value_of
from rhythmid.record.message_types import stamp_path, type_fields, typestore
from rhythmid.record.orientation import angle_of


@dataclass(frozen=True, eq=False)
class Columns:
    """Fields of one topic, in the order in which its n messages were recorded.

    Attributes
    ----------
    log_ns : int64[n], receive time of each message [ns].
    sent_ns : int64[n], the time at which it was published [ns]; None if the bag does not hold it.
    stamp_ns : int64[n], its header's stamp [ns]; None if the type has none.
    values : field -> float64[n]; NaN also where `missing`.
    missing : field -> bool[n], whether the message lacks the entry (a joint that it does not list).
    reason : field -> why the first message without the entry lacks it.
    singly : number of messages that were deserialised one by one.
    """

    topic: Topic
    log_ns: NDArray[np.int64]
    sent_ns: NDArray[np.int64] | None
    stamp_ns: NDArray[np.int64] | None
    values: Mapping[Field, NDArray[np.float64]]
    missing: Mapping[Field, NDArray[np.bool_]]
    reason: Mapping[Field, str]
    singly: int = 0

    def times(self, kind: str) -> NDArray[np.int64] | None:
        """Times [ns] of the messages by one of the `signals.BAG_CLOCKS`, int64[n]; None where they are not recorded."""
        return {"header": self.stamp_ns, "sent": self.sent_ns, "receive": self.log_ns}[kind]


@dataclass
class _Reader:
    """Collects the columns of one topic block by block."""

    topic: Topic
    fields: tuple[Field, ...]
    direct: bool
    layout: Layout | None = None
    log_ns: list[NDArray[np.int64]] = field(default_factory=list)
    sent_ns: list[NDArray[np.int64] | None] = field(default_factory=list)
    rows: list[NDArray[np.float64]] = field(default_factory=list)  # float64[fields, n] each
    missing: list[NDArray[np.bool_]] = field(default_factory=list)
    reason: dict[Field, str] = field(default_factory=dict)
    singly: int = 0

    def __post_init__(self) -> None:
        types = type_fields(self.topic)
        for wanted in self.fields:
            try:
                wanted.check(self.topic.type, types)
            except InputError as error:
                raise InputError(f"topic {self.topic.name}: {error}") from None
        stamp = stamp_path(self.topic)
        self.has_stamp = stamp is not None
        self.parts = [one.components(self.topic.type, types) for one in self.fields]
        self.paths = [
            *chain.from_iterable(self.parts),
            *(Field.parse(f"{stamp}.{part}") for part in ("sec", "nanosec") if stamp),
        ]

    def add(self, block: Block) -> None:
        if block.topic.type != self.topic.type:
            raise InputError(
                f"{self.topic.name}: carries both {self.topic.type} and {block.topic.type}; only one type can be read"
            )
        rows = self._by_layout(block) if self.direct else None
        if rows is None:
            rows, missing = self._one_by_one(block)
        else:
            missing = np.zeros(rows.shape, dtype=bool)
        self.log_ns.append(block.log_ns)
        self.sent_ns.append(block.sent_ns)
        self.rows.append(rows)
        self.missing.append(missing)

    def _by_layout(self, block: Block) -> NDArray[np.float64] | None:
        """Columns by layout; None if the messages' layouts vary."""
        for attempt in range(2):
            try:
                if self.layout is None or attempt:
                    self.layout = Layout(next(iter(block)), self.topic.type, type_fields(self.topic))
                found = [self.layout.locate(path) for path in self.paths]
            except (Unsupported, LookupError):
                continue
            names = [name for _, used in found for name in used]
            if self.layout.fits(block, [number for number, _ in found], names):
                return np.array([self.layout.read(block, number) for number, _ in found]).reshape(
                    len(found), -1
                )
        self.layout = None
        return None

    def _one_by_one(self, block: Block) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        store = typestore(self.topic)
        rows = np.full((len(self.paths), len(block)), np.nan)
        missing = np.zeros(rows.shape, dtype=bool)
        self.singly += len(block)
        for column, data in enumerate(block):
            try:
                message = store.deserialize_cdr(data, self.topic.type)
            except SerdeError as error:
                at = f"message received at {block.log_ns[column] * 1e-9:.6f} s"
                raise InputError(
                    f"{self.topic.name}: {at} is not a valid {self.topic.type}: {error}"
                ) from None
            for row, path in enumerate(self.paths):
                try:
                    rows[row, column] = value_of(message, path)
                except LookupError as error:
                    missing[row, column] = True
                    self.reason.setdefault(path, str(error))
        return rows, missing

    def columns(self) -> Columns:
        rows = np.hstack([np.empty((len(self.paths), 0)), *self.rows])
        missing = np.hstack([np.empty((len(self.paths), 0), dtype=bool), *self.missing])
        stamp_ns = None
        if self.has_stamp:
            second, nanosecond = rows[-2:].astype(np.int64)
            stamp_ns = second * 1_000_000_000 + nanosecond
        log_ns = np.concatenate([np.empty(0, dtype=np.int64), *self.log_ns])
        sent = [part for part in self.sent_ns if part is not None]
        sent_ns = np.concatenate(sent) if sent and len(sent) == len(self.sent_ns) else None
        ends = np.cumsum([len(parts) for parts in self.parts])
        places = [slice(end - len(parts), end) for parts, end in zip(self.parts, ends, strict=True)]
        return Columns(
            self.topic,
            log_ns,
            sent_ns if sent_ns is not None and _says_when_sent(sent_ns, log_ns) else None,
            stamp_ns,
            {one: _value(one, rows[place]) for one, place in zip(self.fields, places, strict=True)},
            {
                one: np.logical_or.reduce(missing[place])
                for one, place in zip(self.fields, places, strict=True)
            },
            {
                one: self.reason[parts[0]]
                for one, parts in zip(self.fields, self.parts, strict=True)
                if parts[0] in self.reason
            },
            self.singly,
        )


def _value(field: Field, rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """A field's values (n,) from those of its components (1, n) or (4, n)."""
    return rows[0] if len(rows) == 1 else angle_of(str(field.steps[-1]), rows)


def _says_when_sent(sent_ns: NDArray[np.int64], log_ns: NDArray[np.int64]) -> bool:
    """Whether these are times of publication: recorders that do not know them write the receive time, or zero."""
    return len(sent_ns) > 0 and int(sent_ns.min()) > 0 and not np.array_equal(sent_ns, log_ns)


def without_times(columns: Columns, kind: str) -> str:
    """What is wrong and what to do where a topic has no times of this kind."""
    if kind == "sent":
        return (
            f"{columns.topic.name}: the bag does not say when its messages were sent (MCAP files of Jazzy and later do); "
            "use  time: receive  for this channel"
        )
    return (
        f"{columns.topic.name}: {columns.topic.type} has no time stamp; use  time: receive  for this channel"
    )


def read_columns(
    blocks: Iterable[Block], wanted: Mapping[str, Sequence[Field]], direct: bool = True
) -> dict[str, Columns]:
    """Read fields of the topics `wanted` (topic -> fields) in one pass over the blocks of a bag.

    `direct=False` deserialises every message one by one, with the same result. Topics without messages are left out.
    Raises InputError when a type or field is unknown.
    """
    readers: dict[str, _Reader] = {}
    for block in blocks:
        name = block.topic.name
        if name in wanted:
            if name not in readers:
                readers[name] = _Reader(block.topic, tuple(wanted[name]), direct)
            readers[name].add(block)
    return {name: reader.columns() for name, reader in readers.items()}
