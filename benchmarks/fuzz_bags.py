"""Bags, messages and their definitions: valid, corrupted, and read."""

import io
import random
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from fuzz_inputs import COUNT, STAMPS, VALUES
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mutation import spoil_bytes

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.bag_report import quality_report
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.block import Block, Topic
from rhythmid.record.columns import Columns, read_columns
from rhythmid.record.compression import compress
from rhythmid.record.field import Field
from rhythmid.record.inventory import inventory
from rhythmid.record.message_types import standard_types
from rhythmid.record.messages import Messages
from rhythmid.record.read import read_record
from rhythmid.record.recover import recover

JOINT_STATE = "sensor_msgs/msg/JointState"
OWN = "robot_msgs/msg/Legs"  # a type that only the bag defines
OWN_DEFINITION = (
    "std_msgs/Header header\nLeg[2] legs\nLeg[] more\nuint8 MOST=7\nstring NOTE='two legs'\nfloat32[3] force\n"
    + "=" * 80 + "\nMSG: robot_msgs/Leg\nstring<=20 name\nfloat64 angle 0.5\nbool[<=4] contact\n"
    + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)  # fmt: skip


# Bags


def _topics() -> dict[str, Messages]:
    return {
        "/hopper/excitation": Messages(STAMPS, effort=VALUES),
        "/hopper/joint_states": Messages(STAMPS, position=VALUES),
    }


def mcap(compression: CompressionType, chunked: bool = True) -> bytes:
    """The topics as an independent writer of MCAP puts them, without checksums, so that damage reaches the messages."""
    file = io.BytesIO()
    writer = McapWriter(
        file,
        chunk_size=2048,
        compression=compression,
        use_chunking=chunked,
        enable_crcs=False,
        repeat_schemas=False,
    )
    writer.start(profile="ros2", library="")
    definition = standard_types().generate_msgdef(JOINT_STATE, ros_version=2)[0].encode()
    schema = writer.register_schema(JOINT_STATE, "ros2msg", definition)
    rows = {writer.register_channel(name, "cdr", schema): m.serialised() for name, m in _topics().items()}
    for k in range(COUNT):
        for channel, data in rows.items():
            writer.add_message(channel, int(STAMPS[k]), data[k].tobytes(), int(STAMPS[k]))
    writer.finish()
    return file.getvalue()


def mcaps() -> list[bytes]:
    kinds = (CompressionType.NONE, CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4)
    return [*(mcap(kind) for kind in kinds), mcap(CompressionType.NONE, chunked=False)]


def spoil_mcap(rng: random.Random, valid: bytes) -> bytes:
    """Change bytes anywhere, or the length of a record, which follows its kind."""
    if rng.random() < 0.7:
        return spoil_bytes(rng, valid)
    places = list(_records(valid))
    at = rng.choice(places)
    spoilt = bytearray(valid)
    spoilt[at + 1 : at + 9] = struct.pack(
        "<Q", rng.choice((0, 1, 5, 21, 22, 23, 2**31, 2**60, 2**63, 2**64 - 1))
    )
    return bytes(spoilt)


def _records(data: bytes) -> Iterator[int]:
    at = 8
    while at + 9 <= len(data) - 8:
        yield at
        at += 9 + struct.unpack_from("<Q", data, at + 1)[0]


def databases() -> list[bytes]:
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / "bag", _topics(), storage="sqlite3")
        return [(path / "bag.db3").read_bytes()]


CELLS = (
    "NULL",
    "1",
    "-1",
    "9223372036854775807",
    "'x'",
    "x'00'",
    "x'28b52ffd'",
    "zeroblob(70000)",
    "1.5",
    "''",
    "char(27,0)",
)
COLUMNS = {
    "messages": ("id", "topic_id", "timestamp", "data"),
    "topics": ("id", "name", "type", "serialization_format", "offered_qos_profiles"),
    "message_definitions": ("topic_type", "encoding", "encoded_message_definition"),
    "metadata": ("metadata", "metadata_version"),
}


def spoil_database(rng: random.Random, valid: bytes) -> bytes:
    """Bytes of the file, or cells of its tables by SQL: sqlite itself then sees no damage."""
    if rng.random() < 0.6:
        return spoil_bytes(rng, valid)
    with closing(sqlite3.connect(":memory:")) as database:
        database.deserialize(valid)
        for _ in range(rng.randint(1, 3)):
            table = rng.choice(list(COLUMNS))
            column = rng.choice(COLUMNS[table])
            cell = rng.choice(CELLS)
            try:
                database.execute(
                    f"UPDATE {table} SET {column} = {cell} WHERE rowid % {rng.randint(1, 4)} = 0"
                )
            except sqlite3.Error:
                continue
        database.commit()
        return database.serialize()


def use_bag(suffix: str) -> Callable[[bytes, Path, int], None]:
    def use(data: bytes, folder: Path, number: int) -> None:
        path = folder / f"bag{suffix}"
        path.write_bytes(data)
        (read_record, quality_report, inventory)[number % 3](path)

    return use


def use_recover(data: bytes, folder: Path, number: int) -> None:
    path = folder / ("bag.db3" if data.startswith(b"SQLite") else "bag.mcap")
    path.write_bytes(data)
    recover(path, folder / "recovered")


def spoil_any_bag(rng: random.Random, valid: bytes) -> bytes:
    return (spoil_database if valid.startswith(b"SQLite") else spoil_mcap)(rng, valid)


def metadata() -> list[bytes]:
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / "bag", _topics())
        return [(path / "metadata.yaml").read_bytes().replace(b"bag.mcap", b"bag_0.mcap")]


def use_metadata(data: bytes, folder: Path, number: int) -> None:
    (folder / "metadata.yaml").write_bytes(data)
    (folder / "bag_0.mcap").write_bytes(_plain_mcap())
    for _ in Bag(folder).blocks():
        pass


@cache
def _plain_mcap() -> bytes:
    return mcap(CompressionType.NONE)


# Messages and their definitions

TOPIC = Topic("/legs", JOINT_STATE)
OWN_TOPIC = Topic("/legs", OWN, definition=OWN_DEFINITION, definition_format="ros2msg")
FIELDS = {
    JOINT_STATE: ("position[leg]", "velocity[0]", "effort[1]"),
    OWN: ("legs[0].angle", "legs[0].contact[1]", "more[1].angle", "force[2]"),
}


def _own_message() -> bytes:
    def text(value: bytes) -> bytes:
        return struct.pack("<I", len(value) + 1) + value + b"\0"

    def padded(data: bytes, size: int) -> bytes:
        return data + bytes(-len(data) % size)

    body = struct.pack("<iI", 5, 7) + text(b"map")
    for group in ((b"left", b"right"), (b"fore", b"hind")):
        if group[0] == b"fore":
            body = padded(body, 4) + struct.pack("<I", 2)
        for name in group:
            body = padded(padded(body, 4) + text(name), 8) + struct.pack("<dI", 0.25, 2) + b"\1\0"
    return b"\0\1\0\0" + padded(body, 4) + struct.pack("<3f", 1.0, 2.0, 3.0)


def messages() -> list[bytes]:
    rows = Messages(STAMPS[:1], VALUES[:1], VALUES[:1], VALUES[:1]).serialised()
    return [rows[0].tobytes(), _own_message(), _own_message()]


def use_message(data: bytes, folder: Path, number: int) -> None:
    """The corrupted message among intact ones, read by layout and one by one: both have to accept the same."""
    whole = messages()
    topic, good = (TOPIC, whole[0]) if abs(len(data) - len(whole[0])) < abs(len(data) - len(whole[1])) else (
        OWN_TOPIC, whole[1]
    )  # fmt: skip
    parts = [data] if number % 2 else [good, data, good]
    size = np.array([len(part) for part in parts], dtype=np.int64)
    block = Block(topic, b"".join(parts), np.cumsum(size) - size, size, STAMPS[: len(parts)])
    wanted = {topic.name: [Field.parse(text) for text in FIELDS[topic.type]]}
    found = [_columns_or_refusal(block, wanted, direct) for direct in (True, False)]
    refusals = [one for one in found if isinstance(one, InputError)]
    if refusals:
        raise refusals[0]
    by_layout, singly = (one for one in found if isinstance(one, Columns))
    for field, values in by_layout.values.items():
        np.testing.assert_array_equal(values, singly.values[field], err_msg=field.text)


def _columns_or_refusal(block: Block, wanted: dict[str, list[Field]], direct: bool) -> Columns | InputError:
    try:
        return read_columns([block], wanted, direct)[block.topic.name]
    except InputError as error:
        return error


def definitions() -> list[bytes]:
    return [OWN_DEFINITION.encode()]


def use_definition(data: bytes, folder: Path, number: int) -> None:
    topic = Topic(
        "/legs",
        OWN,
        definition=data.decode("utf-8", "replace"),
        definition_format=("ros2msg", "ros2idl")[number % 9 == 0],
    )
    message = _own_message()
    one = np.array([0], dtype=np.int64)
    block = Block(topic, message, one, one + len(message), one)
    for direct in (True, False):
        read_columns([block], {topic.name: [Field.parse("force[2]")]}, direct)


def spoil_packed_bag(rng: random.Random, valid: bytes) -> bytes:
    return spoil_bytes(rng, compress(valid)) if rng.random() < 0.5 else compress(spoil_mcap(rng, valid))
