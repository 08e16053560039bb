"""Data-quality report of a recording: rate, jitter, gaps and lateness of every topic, and the mapped channels."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.angle_wrap import wrap_notes
from rhythmid.record.bag import Bag, is_bag
from rhythmid.record.block import Block
from rhythmid.record.braking import braking_notes
from rhythmid.record.cleaning import LeftOut, cleaned, peak_note, placeholder_notes
from rhythmid.record.columns import Columns, read_columns
from rhythmid.record.folder_of_tables import size_of
from rhythmid.record.gaps import Cut, cut_at_gaps
from rhythmid.record.joint_notes import notes_of_joints
from rhythmid.record.joint_record import JointSignals, names_joints, read_joint_record
from rhythmid.record.message_types import stamp_path
from rhythmid.record.other_lengths import read_length_notes
from rhythmid.record.output_copy import copy_notes
from rhythmid.record.quality import ChannelQuality
from rhythmid.record.read import read_record
from rhythmid.record.record import Record
from rhythmid.record.rest_at_ends import rest_notes
from rhythmid.record.signals import Signals
from rhythmid.record.standstill import standstill
from rhythmid.record.timing import Timing
from rhythmid.record.two_clocks import read_clock_notes
from rhythmid.record.unsigned import unsigned_notes

PACED = 10  # messages, below which a topic holds events, and has no rate to report
MEGABYTE = 1e6  # bytes; smaller sizes are given in kB


@dataclass(frozen=True)
class TopicReport:
    """One topic: its type, the timing of its receive times and of its header stamps, and receive time minus stamp [s]."""

    name: str
    type: str
    received: Timing
    stamped: Timing | None = None
    lateness_mean: float | None = None
    lateness_max: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON: the timing by header stamp where there is one, else by receive time."""
        timing = self.stamped or self.received
        return {
            "name": self.name,
            "type": self.type,
            "count": self.received.count,
            "clock": "header" if self.stamped else "receive",
            "rate": timing.rate,
            "receive_rate": self.received.rate,
            "jitter_std": timing.jitter_std,
            "gaps": timing.gaps,
            "lost": timing.lost,
            "usual_range": timing.usual_range,
            "longest_gap": timing.longest_gap,
            "duplicates": timing.duplicates,
            "late": timing.late,
            "lateness_mean": self.lateness_mean,
            "lateness_max": self.lateness_max,
        }


@dataclass(frozen=True)
class BagReport:
    """Report on one recording.

    Attributes
    ----------
    path, size : location and size [bytes]; for tables, of the files that are read.
    duration : from the first to the last message received [s].
    topics : one report each, in order of name; empty for tables.
    channels : quality of the mapped channels by role; empty if they cannot be read.
    problems : reasons why the recording cannot be used as mapped, one line each; empty if it can.
    notes : messages about the recording, one line each.
    damage : the notes about damage of the files; empty for a complete recording.
    record : what could be read; None if it cannot be used as mapped.
    left_out : samples that no analysis will use, by the role of the output ("joint.output" for several joints), one
        entry for each reason; the notes state them as well.
    assumed : the notes about assumptions of the signals.yaml.
    columns : number of table columns that are read, including the time; 0 for a bag.
    cut : the record as an analysis uses it, cut where commands are missing; None if it cannot be used.
    """

    path: Path
    size: int = 0
    duration: float = 0.0
    topics: tuple[TopicReport, ...] = ()
    channels: dict[str, ChannelQuality] = field(default_factory=dict)
    truncated: bool = False
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    record: Record | None = None
    left_out: Mapping[str, tuple[LeftOut, ...]] = field(default_factory=dict[str, tuple[LeftOut, ...]])
    cut: Cut | None = None
    columns: int = 0
    assumed: tuple[str, ...] = ()

    @property
    def remarks(self) -> list[str]:
        """Remarks on a recording that can be used, one line each."""
        complaints = [
            f"{role}: {one}" for role, channel in self.channels.items() for one in channel.complaints()
        ]
        return [*self.notes, *complaints]

    @property
    def matters(self) -> list[str]:
        """The remarks that may change a result, one line each: `check --strict` fails on them."""
        complaints = [
            f"{role}: {one}" for role, channel in self.channels.items() for one in channel.matters()
        ]
        return [*self.problems, *(note for note in self.notes if note not in self.assumed), *complaints]

    @property
    def usable(self) -> bool:
        """Whether a record can be read from the recording."""
        return not self.problems

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "path": str(self.path),
            "size": self.size,
            "duration": self.duration,
            "truncated": self.truncated,
            "usable": self.usable,
            "topics": [topic.to_dict() for topic in self.topics],
            "channels": {role: channel.to_dict() for role, channel in self.channels.items()},
            "problems": list(self.problems),
            "notes": list(self.notes),
            "damage": list(self.damage),
            "matters": self.matters,
            "left_out": [
                {**one.to_dict(), "channel": role} for role, found in self.left_out.items() for one in found
            ],
            "cut": None if self.cut is None else {
                "gaps": [list(gap) for gap in self.cut.gaps],
                "stretches": [
                    {"name": one.name, "start": float(one.output.time[0]), "end": float(one.output.time[-1])}
                    for one in self.cut.stretches
                ],
            },
        }  # fmt: skip

    def lines(self) -> list[str]:
        """The report as plain text, without the problems."""
        size = f"{self.size / 1e6:.1f} MB" if self.size >= MEGABYTE else f"{self.size / 1e3:.1f} kB"
        held = f"{self.columns} columns read" if self.columns else f"{len(self.topics)} topics"
        found = [f"{self.path}: {size}, {self.duration:.3f} s, {held}"]
        width = max((len(topic.name) for topic in self.topics), default=0)
        for topic in self.topics:
            timing = topic.stamped or topic.received
            late = "" if topic.lateness_mean is None else (
                f", received {1e3 * topic.lateness_mean:.3f} ms after the stamp (at most {1e3 * topic.lateness_max:.3f})"
                if topic.lateness_max is not None else ""
            )  # fmt: skip
            pace = f"{timing.told_rate}, jitter {1e6 * timing.jitter_std:.3g} us, {timing.gaps} gaps, "
            found.append(
                f"  {topic.name:{width}}  {topic.type}  {timing.count} messages, "
                f"{pace if timing.count >= PACED else ''}{timing.duplicates} duplicates{late}"
            )
        for role, channel in self.channels.items():
            facts = ", ".join(channel.facts())
            found.append(f"  {role}: {channel.source}: {facts}: {self._verdict(role, channel)}")
        found += [f"  note: {note}" for note in self.notes]
        return found

    def _verdict(self, role: str, channel: ChannelQuality) -> str:
        """Remark on a channel; "flawless" where there is none on it or on the recording."""
        said = channel.complaints()
        if left_out := self.left_out.get(role):
            said.append(f"{sum(one.count for one in left_out)} of {left_out[0].total} samples are left out")
        if said:
            return "; ".join(said)
        if self.damage:
            return "what could be read is flawless, but files are damaged"
        return "nothing but what the notes say" if self.notes else "flawless"


def quality_report(
    source: str | Path, signals: Signals | JointSignals | str | Path | None = None
) -> BagReport:
    """Report on a bag, or on the tables that a signals.yaml names. For several joints it has all channels, by
    "joint.role".

    The report states what analyses will leave out of the record and where they will cut it. Problems that make the
    recording unusable as a record are reported, not raised: InputError is raised only for a source that is no
    recording.
    """
    source = Path(source)
    if isinstance(signals, (str, Path)):
        signals = JointSignals.load(signals) if names_joints(signals) else Signals.load(signals)
    channels: dict[str, ChannelQuality] = {}
    problems: list[str] = []
    notes: list[str] = []
    assumed: list[str] = []
    left_out: dict[str, tuple[LeftOut, ...]] = {}
    duration, record, cut = 0.0, None, None
    try:
        parts: dict[str, Record] = {}
        if isinstance(signals, JointSignals):
            parts = {f"{joint}.": one for joint, one in read_joint_record(source, signals).every.items()}
        else:
            record = read_record(source, signals)
            parts = {"": record}
            named = Signals.load(source) if source.suffix in (".yaml", ".yml") else signals
            notes += [] if named is None else read_length_notes(source, named)
            notes += [] if named is None else read_clock_notes(source, named)
        if record is None:
            left_out = {f"{begin}output": cleaned(one).left_out for begin, one in parts.items()}
        notes += _of_channels(parts, left_out)
        for begin, one in parts.items():
            channels |= {f"{begin}{role}": channel for role, channel in one.quality.channels.items()}
            wrapped = wrap_notes(one)  # they are removed and change no result
            assumed += [*one.quality.assumed, *(f"{begin or f'{one.name}: '}{note}" for note in wrapped)]
            notes += [f"{begin}{note}" for note in (*wrapped, *rest_notes(one)) if begin]
            if begin and (still := standstill(one)) is not None:
                notes.append(f"{begin}output: {still}")
        duration = max(one.duration for one in parts.values())
    except InputError as error:
        if not is_bag(source) or not source.exists():
            raise
        problems.append(str(error))
    if record is not None:
        try:
            clean = cleaned(record)
            left_out, cut = {"output": clean.left_out}, cut_at_gaps(clean.record)
            notes += [*clean.notes, *cut.notes]
            if (still := standstill(clean.record)) is not None:
                notes.append(f"output: {still}")
            if (peaks := peak_note(record)) is not None:
                notes.append(peaks)
        except InputError as error:
            problems.append(str(error))
    if not is_bag(source):
        size, columns = _tables(source, signals)
        return BagReport(
            source, size, duration, (), channels, problems=tuple(problems), notes=tuple(notes),
            record=record, left_out=left_out, cut=cut, columns=columns, assumed=tuple(assumed),
        )  # fmt: skip
    bag = Bag(source, verify=True)
    received, stamped = _times(bag)
    lost = bag.lost({name: len(log_ns) for name, log_ns in received.items()})
    damage = (*bag.notes, *(f"{name}: {count} messages are missing" for name, count in lost.items()))
    notes += [note for note in damage if note not in notes]
    times = [log_ns for log_ns in received.values() if len(log_ns)]
    if times:
        duration = (
            max(int(log_ns.max()) for log_ns in times) - min(int(log_ns.min()) for log_ns in times)
        ) * 1e-9
    zero = [name for name, one in stamped.items() if _is_without_times(one)]
    notes += [
        f"{name}: its stamps are all zero, so that only the times of receipt tell when it was sent"
        for name in zero
    ]
    topics = tuple(
        _topic_report(name, topic.type, received.get(name, np.empty(0, dtype=np.int64)), stamped.get(name))
        for name, topic in sorted(bag.topics.items())
    )
    size = sum(file.stat().st_size for file in bag.files)
    return BagReport(
        source, size, duration, topics, channels, bag.truncated, tuple(problems), tuple(notes), damage, record,
        left_out, cut, assumed=tuple(assumed),
    )  # fmt: skip


def _of_channels(parts: Mapping[str, Record], left_out: Mapping[str, tuple[LeftOut, ...]]) -> list[str]:
    """Notes on the channels of each part, with its joints, and for joints on what is left out of their outputs; what
    is told of the channels of all parts alike concerns the recording."""
    said = {begin: one.quality.notes for begin, one in parts.items()}
    own = {
        begin: [*copy_notes(one), *unsigned_notes(one), *braking_notes(one)] for begin, one in parts.items()
    }
    if "" in parts:
        return [*said[""], *own[""]]
    for begin, one in parts.items():
        own[begin] += placeholder_notes(one)
        own[begin] += [part.words for part in left_out[f"{begin}output"]]
    alike = [
        note for note in dict.fromkeys(chain(*said.values())) if all(note in one for one in said.values())
    ]
    of_joints = {
        begin.rstrip("."): [note for note in (*said[begin], *own[begin]) if note not in alike]
        for begin in parts
    }
    return alike + notes_of_joints(of_joints)


def _tables(source: Path, signals: Signals | JointSignals | None) -> tuple[int, int]:
    """Size [bytes] of the tables that are read, and number of columns that are read."""
    if source.suffix in (".yaml", ".yml"):
        signals = JointSignals.load(source) if names_joints(source) else Signals.load(source)
    if isinstance(signals, JointSignals):
        given = [*signals.joints.values(), *([] if signals.base is None else [signals.base])]
    else:
        given = [] if signals is None else [signals]
    read = {(one.file or source, one.column) for part in given for one in part.channels.values()}
    files = {file for file, _ in read}
    read |= {(file, part.time.column) for part in given if part.time.kind == "column" for file in files}
    return sum(map(size_of, files)), len(read)


def _times(bag: Bag) -> tuple[dict[str, NDArray[np.int64]], dict[str, Columns]]:
    """Receive times [ns] of every topic, and the columns of topics whose messages have a stamp."""
    received: dict[str, list[NDArray[np.int64]]] = {}
    for block in bag.blocks():
        received.setdefault(block.topic.name, []).append(block.log_ns)
    stamped: dict[str, Columns] = {}
    for name, topic in bag.topics.items():
        try:
            if stamp_path(topic) is not None:
                stamped |= read_columns(_only(Bag(bag.path), name), {name: []})
        except InputError:
            continue  # unknown type or damaged: only its receive times are used
    return {name: np.concatenate(parts) for name, parts in received.items()}, stamped


def _only(bag: Bag, name: str) -> Iterator[Block]:
    return bag.blocks(lambda topic: topic.name == name)


def _is_without_times(columns: Columns) -> bool:
    """Whether all message stamps are zero, as from a node that does not set them."""
    return columns.stamp_ns is not None and len(columns.stamp_ns) > 0 and not columns.stamp_ns.any()


def _topic_report(name: str, msgtype: str, log_ns: NDArray[np.int64], columns: Columns | None) -> TopicReport:
    def seconds(times: NDArray[np.int64]) -> NDArray[np.float64]:
        return (times - times.min()) * 1e-9 if len(times) else np.empty(0)

    received = Timing.of(seconds(log_ns))
    if columns is None or columns.stamp_ns is None or not len(log_ns) or _is_without_times(columns):
        return TopicReport(name, msgtype, received)
    lateness = (columns.log_ns - columns.stamp_ns) * 1e-9
    return TopicReport(
        name,
        msgtype,
        received,
        Timing.of(seconds(columns.stamp_ns)),
        float(lateness.mean()),
        float(lateness.max()),
    )
