"""Inventory of a source: every number that was recorded repeatedly, a field of a topic or a column of a table, with
its times."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag, is_bag
from rhythmid.record.block import Topic
from rhythmid.record.columns import Columns, read_columns
from rhythmid.record.encoder_turn import counts_of_turn
from rhythmid.record.field import NAMES, OWN_NAMES, Field
from rhythmid.record.foreign_file import refuse_foreign
from rhythmid.record.grouped_runs import grouped_runs
from rhythmid.record.heading import heading_of
from rhythmid.record.joined_stamps import stamp_pairs
from rhythmid.record.merged_table import is_merged, is_sampled_rarely
from rhythmid.record.message_types import type_fields, typestore
from rhythmid.record.orientation import ANGLES
from rhythmid.record.other_lengths import length_notes, unequal_arrays
from rhythmid.record.placeholder import placeholder_of
from rhythmid.record.sign_bit import sign_bit_of, signed
from rhythmid.record.signals import BAG_CLOCKS, Clock
from rhythmid.record.stated_rate import clock_of_counter, stated_rate
from rhythmid.record.table import SUFFIXES, WIDEST, Table, is_table, table_suffix
from rhythmid.record.table_clock import COUNTER, is_even, is_further_time, is_time, table_clock
from rhythmid.record.two_clocks import clock_notes, trusted_clock

Array = NDArray[np.float64]
StatedRole = Literal["output", "input", "reference", "base", "forcing"]
OBJECTS = (
    "a table or timetable of MATLAB is an object that others cannot read: there  writetimetable(T, 'run.csv')"
)
DEEPEST = 5  # nesting depth of messages that are read
SKIPPED_PACKAGES = (
    "diagnostic_msgs",
    "rcl_interfaces",
    "rosgraph_msgs",
    "visualization_msgs",
    "nav_msgs",
    "tf2_msgs",
)
VEHICLES = ("nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage")  # computed poses of a vehicle or a robot
FIXED = "/tf_static"  # constant frames
FIRST = 200  # number of messages whose entries are listed: several nodes may publish frames in turn
SKIPPED_FIELDS = re.compile(r"header|stamp|.*covariance|orientation|layout|points|time_from_start")
QUATERNION = "Quaternion"  # an orientation in four numbers, none of which is an angle by itself


@dataclass(frozen=True, eq=False)
class Recorded:
    """One recorded number.

    Attributes
    ----------
    topic, type, field : of a message; empty for a column.
    column : name of the column; empty for a message's field.
    joint : name of its joint, where one is stated.
    side : `left` or `right` where another column's name differs only in that; else empty.
    said : its name within the message or table, such as `position` or the heading without its unit.
    sign_bit : place of the bit that is the sign of the recorded words; None where they are ordinary numbers.
    unit, scale : SI unit, empty where not stated, and its factor per recorded unit.
    time, value : float64[n], [s] and recorded values times `scale`; a message's time is its receive time.
    stated : the role that the user gives it, None where it is to be guessed.
    stamped, sent : whether its messages have stamps, and whether the bag says when they were sent.
    """

    said: str
    time: Array
    value: Array
    topic: str = ""
    type: str = ""
    field: str = ""
    column: str = ""
    joint: str = ""
    unit: str = ""
    scale: float = 1.0
    written_unit: str = ""
    stamped: bool = False
    sent: bool = False
    side: str = ""
    sign_bit: int | None = None
    stated: StatedRole | None = None

    def __str__(self) -> str:
        return f"{self.topic} {self.field}" if self.topic else self.column

    @property
    def rate(self) -> float:
        """Samples per second, 0 for a single sample."""
        span = float(self.time[-1] - self.time[0]) if len(self.time) > 1 else 0.0
        return (len(self.time) - 1) / span if span > 0.0 else 0.0


@dataclass(frozen=True)
class Inventory:
    """All changing numbers of a source; how its times are given, and why; what was left out, including constants;
    messages for the user; and for a bag all numbers in the order of their messages, and the angles of its orientations, which are
    used only where the user says so."""

    path: Path
    recorded: tuple[Recorded, ...]
    clock: Clock
    clock_reason: str
    left_out: tuple[str, ...] = ()
    constant: tuple[Recorded, ...] = ()
    notes: tuple[str, ...] = ()
    listed: tuple[Recorded, ...] = ()
    angles: tuple[Recorded, ...] = ()

    @property
    def is_bag(self) -> bool:
        """Whether the source is a bag, not a table."""
        return self.clock.kind in BAG_CLOCKS


def inventory(source: str | Path, rate: float | None = None, vehicle: bool = False) -> Inventory:
    """Inventory of a bag or table; `rate` [Hz] is that of a table without a time. Raises InputError, one line.

    With `vehicle`, a bag's odometry and frame trees are included.
    """
    source = Path(source)
    if not source.exists():
        raise InputError(f"{source}: no such file or directory")
    refuse_foreign(source)
    if is_table(source):
        table = Table.load(source)
        runs = grouped_runs(table)
        if runs is None:
            return _of_table(table, rate)
        found = _of_table(runs.alone(table), rate)
        note = f"it holds {runs.note}, and this is the first; each as a table of its own:  rhythmid split {source} --out runs"
        return replace(found, notes=(note, *found.notes))
    if not is_bag(source):
        raise InputError(
            f"{source}: is neither a bag (directory, .mcap, .db3) nor a table ({', '.join(SUFFIXES)})"
        )
    return _of_bag(Bag(source), vehicle)


@np.errstate(over="ignore", invalid="ignore")  # for numbers near the largest, and NaN of every kind
def _of_table(table: Table, rate: float | None) -> Inventory:
    columns = list(table.vectors())
    if not columns:
        arrays = "; ".join(map(str, unequal_arrays(table, 0)))
        of_matlab = OBJECTS if table_suffix(table.path) == ".mat" else ""
        why = f"; {arrays or of_matlab}" if arrays or of_matlab else ""
        raise InputError(f"{table.path}: holds no column of numbers{why}")
    count = _rows_of(columns)
    unequal = [(name, value) for name, value in columns if len(value) != count]
    columns = [(name, value) for name, value in columns if len(value) == count]
    notes = (*table.notes, *length_notes(table, count))
    told = None if rate is not None else stated_rate(table, columns)
    if told is not None:
        rate, reason = told
        clock, every = Clock("rate", rate=rate), np.arange(count) / rate
    elif rate is not None:
        clock, reason, every = Clock("rate", rate=rate), "as given with --rate", np.arange(count) / rate
    else:
        clock, reason = clock_of_counter(table, columns, *table_clock(table.path, columns, unequal))
        if is_time(str(clock.column), dict(columns)[str(clock.column)]):
            clock, reason = trusted_clock(columns, clock, reason)
        every = dict(columns)[str(clock.column)] * clock.scale
        notes += clock_notes(columns, str(clock.column), every)
    found, constant = [], []
    left = [f"{name}: holds words, such as {word!r}" for name, word in table.words()]
    left += map(str, unequal_arrays(table, count))
    merged = is_merged(value for name, value in columns if name != clock.column)
    parts = {part for pair in stamp_pairs(table.columns).values() for part in pair}
    for name, value in columns:
        heading, time = heading_of(name), every
        if name in parts:
            continue
        if clock.kind == "column" and (
            name == clock.column or is_further_time(name, value[~np.isnan(value)])
        ):
            continue
        if clock.kind == "rate" and (is_time(name, value) or (name.isdigit() and is_even(value))):
            left.append(f"{name}: goes forward like a time")
            continue
        if merged or is_sampled_rarely(value):
            time, value = time[~np.isnan(value)], value[~np.isnan(value)]
        if not heading.unit and (turn := counts_of_turn(value)):
            heading = replace(
                heading, unit="rad", scale=2.0 * math.pi / turn, written=f"of {turn:.0f} a turn"
            )
            notes += (
                f"{name}: begins again after {turn:.0f}, as an encoder does after a turn: it is taken in rad, scale: 2π/{turn:.0f}",
            )
        sign_bit = sign_bit_of(value)
        value = signed(value, sign_bit)
        one = Recorded(
            heading.name, time, value * heading.scale, column=name, unit=heading.unit, scale=heading.scale,
            written_unit=heading.written, sign_bit=sign_bit,
        )  # fmt: skip
        step = np.diff(value)
        if len(step) and np.ptp(step) == 0.0 and (COUNTER.fullmatch(heading.name) or step[0] == 1.0):
            left.append(f"{name}: counts the rows")
        elif not np.isfinite(value).any() or np.nanmax(value) == np.nanmin(value):
            left.append(f"{name}: never changes")
            constant.append(one)
        else:
            found.append(one)
    return Inventory(table.path, tuple(found), clock, reason, tuple(left), tuple(constant), notes)


def _rows_of(columns: list[tuple[str, Array]]) -> int:
    """The number of rows that most columns have; in a tie, that of a column called a time."""
    lengths = [len(value) for _, value in columns]
    timed = {len(value) for name, value in columns if is_time(name, value)}
    return max(lengths, key=lambda count: (count in timed and lengths.count(count) > 1, lengths.count(count)))


def _of_bag(bag: Bag, vehicle: bool) -> Inventory:
    first: dict[str, tuple[Topic, list[bytes]]] = {}
    for block in bag.blocks():
        if block.topic.name not in first and len(block):
            count = FIRST if block.topic.type in VEHICLES else 1
            first[block.topic.name] = block.topic, [bytes(one) for one in islice(block, count)]
    wanted: dict[str, list[Recorded]] = {}
    left: list[str] = []
    for name, (topic, data) in sorted(first.items()):
        looked_into = vehicle and topic.type in VEHICLES and name != FIXED
        if topic.type.split("/")[0] in SKIPPED_PACKAGES and not looked_into:
            left.append(f"{name}: {topic.type}")
            continue
        try:
            messages = [typestore(topic).deserialize_cdr(one, topic.type) for one in data]
        except Exception as error:  # an undefined type, or a damaged message
            left.append(f"{name}: {' '.join(str(error).split())}")
            continue
        empty = np.empty(0)
        fields = [
            Recorded(said, empty, empty, topic.name, topic.type, path, joint=joint)
            for path, said, joint in dict.fromkeys(part for one in messages for part in _numbers(one))
        ]
        if fields:
            wanted[name] = fields
        else:
            left.append(f"{name}: {topic.type} holds no number that could be a signal")
    left += [f"{name}: is empty" for name in sorted(bag.topics) if name not in first]
    columns = read_columns(
        Bag(bag.path).blocks(lambda topic: topic.name in wanted),
        {name: [Field.parse(one.field) for one in fields] for name, fields in wanted.items()},
    )
    begin = min((int(one.log_ns.min()) for one in columns.values() if len(one.log_ns)), default=0)
    found = [one for name, fields in wanted.items() for one in _filled(fields, columns[name], begin)]
    angles = tuple(replace(one, unit="rad", written_unit="rad") for one in found if _is_angle(one, bag))
    found = [one for one in found if all(str(one) != str(each) for each in angles)]
    left += [_said_of_angles(one) for one in angles[:: len(ANGLES)]]
    moving = [one for one in found if len(one.value) > 1 and np.ptp(one.value) > 0.0]
    constant = [one for one in found if one not in moving]
    left += [f"{one}: never changes" for one in constant]
    if not moving and not vehicle:
        return _of_bag(Bag(bag.path), vehicle=True)
    if not moving:
        raise InputError(
            f"{bag.path}: no topic holds a number that changes; topics: {', '.join(sorted(bag.topics)) or 'none'}"
        )
    still = tuple(one for one in constant if len(one.value) > 1)
    return Inventory(
        bag.path, tuple(moving), Clock("receive"), "", tuple(left), still, listed=tuple(found), angles=angles
    )


def _is_angle(one: Recorded, bag: Bag) -> bool:
    """Whether a message's number is an angle of an orientation."""
    return len(Field.parse(one.field).components(one.type, type_fields(bag.topics[one.topic]))) > 1


def _said_of_angles(one: Recorded) -> str:
    """What to do where an angle of an orientation is the motion."""
    whole = one.field.rpartition(".")[0]
    angles = ", ".join(f"{whole}.{angle}" for angle in ANGLES)
    return f"{one.topic} {whole}: an orientation, whose angles in rad are {angles}; where one is the motion, say  --role output='{one}'"


def _filled(fields: list[Recorded], columns: Columns, begin: int) -> Iterator[Recorded]:
    """Fields of one topic with their samples."""
    stamped = columns.stamp_ns is not None and bool((columns.stamp_ns > 0).any())
    for one in fields:
        field = Field.parse(one.field)
        value = columns.values[field]
        kept, placeholder = np.isfinite(value), placeholder_of(value)
        if placeholder is not None:
            kept &= ~placeholder.where
        time = (columns.log_ns[kept] - begin) * 1e-9
        order = np.argsort(time, kind="stable")
        value = value[kept][order]
        sign_bit = sign_bit_of(value)
        yield replace(
            one, time=time[order], value=signed(value, sign_bit), stamped=stamped, sent=columns.sent_ns is not None,
            sign_bit=sign_bit,
        )  # fmt: skip


def _numbers(
    message: Any, path: str = "", said: str = "", joint: str = "", above: tuple[Any, ...] = ()
) -> Iterator[tuple[str, str, str]]:
    """Path, name and joint of every number in a message."""
    if len(above) > DEEPEST:
        return
    above = (*above, message)
    for name in getattr(message, "__dataclass_fields__", {}):
        value = getattr(message, name)
        here, words = f"{path}.{name}" if path else name, f"{said} {name}".strip()
        if type(value).__name__.endswith(QUATERNION):
            yield from ((f"{here}.{angle}", f"{words} {angle}", joint) for angle in ANGLES)
            continue
        # constants of a type are capitalised, fields are not: docs.ros.org, ROS 2 interface definitions
        if name.startswith("__") or name.isupper() or SKIPPED_FIELDS.fullmatch(name):
            continue
        if hasattr(value, "__dataclass_fields__"):
            yield from _numbers(value, here, words, joint, above)
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield here, words, joint
        elif isinstance(value, (list, tuple, np.ndarray)) and 0 < len(value) <= WIDEST:
            yield from _entries(value, here, words, joint, above)


def _entries(
    values: Any, path: str, said: str, joint: str, above: tuple[Any, ...]
) -> Iterator[tuple[str, str, str]]:
    """Path, name and joint of every number in a list; entries have names where a list of names is beside them."""
    if isinstance(values[0], (str, bool, bytes)):
        return
    names = _own_names(values) or _names(above[-1], len(values), NAMES)
    interfaces = _names(
        above[-1], len(values), ("interface_names",)
    )  # control_msgs/InterfaceValue: position, effort, …
    for number, value in enumerate(values):
        here = f"{path}[{names[number] if names else number}]"
        of_joint = names[number] if names else joint
        if hasattr(value, "__dataclass_fields__"):
            yield from _numbers(value, here, said, of_joint, above)
        elif interfaces:
            yield here, interfaces[number], of_joint
        else:
            yield here, said, of_joint or (f"#{number}" if len(values) > 1 else "")


def _own_names(values: Any) -> list[str] | None:
    """Names contained in the entries of a list, if they are distinct."""
    names = [str(getattr(one, key)) for one in values for key in OWN_NAMES if hasattr(one, key)]
    return names if len(names) == len(values) == len(set(names)) and all(map(_in_path, names)) else None


def _in_path(name: Any) -> bool:
    """Whether a path can contain this name of an entry."""
    return isinstance(name, str) and bool(re.fullmatch(r"[^\[\]\s]+", name)) and not name.isdigit()


def _names(message: Any, count: int, keys: tuple[str, ...]) -> list[str] | None:
    """Names of `count` entries in the message, distinct and usable in a path."""
    for key in keys:
        names = getattr(message, key, None)
        if isinstance(names, list) and len(names) == count == len(set(names)):
            if all(map(_in_path, names)):
                return names
    return None


def header_clock(chosen: Mapping[str, Recorded]) -> tuple[Clock, str]:
    """Stamps where every chosen topic has them, else the times at which messages were sent, else receive times."""
    without = sorted({one.topic for one in chosen.values() if not one.stamped})
    if without and all(one.sent for one in chosen.values()):
        return Clock(
            "sent"
        ), f"{', '.join(without)} bears no stamps, so the times at which messages were sent are compared"
    if without:
        return Clock("receive"), f"{', '.join(without)} bears no stamps, so times of receipt are compared"
    return Clock("header"), "all of these topics bear stamps"
