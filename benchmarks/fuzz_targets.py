"""What reads files of others: for each reader valid inputs, how they are spoilt, and the call that has to refuse or accept them.

A target's `use` returns when the input is accepted and raises InputError when it is refused; anything else is a failure.
"""

import gzip
import io
import random
import sqlite3
import struct
import zipfile
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mutation import Mutation, spoil_bytes, spoil_text
from scipy.io import savemat

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.latency import Latency
from rhythmid.model import Model
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
from rhythmid.record.signals import Signals

COUNT = 24  # messages and rows of the valid inputs: few, so that damage often strikes what matters
STAMPS = 5_000_000_000 + np.arange(COUNT, dtype=np.int64) * 1_000_000
VALUES = np.random.default_rng(7).standard_normal(COUNT).round(3)
JOINT_STATE = "sensor_msgs/msg/JointState"
OWN = "robot_msgs/msg/Legs"  # a type that only the bag defines
OWN_DEFINITION = (
    "std_msgs/Header header\nLeg[2] legs\nLeg[] more\nuint8 MOST=7\nstring NOTE='two legs'\nfloat32[3] force\n"
    + "=" * 80 + "\nMSG: robot_msgs/Leg\nstring<=20 name\nfloat64 angle 0.5\nbool[<=4] contact\n"
    + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)  # fmt: skip


@dataclass(frozen=True)
class Target:
    """A reader under attack.

    Attributes
    ----------
    name : as given on the command line.
    valid : makes the valid inputs.
    spoil : makes a hostile input of a valid one.
    use : reads it: input, an empty folder of its own, number of the input.
    """

    name: str
    valid: Callable[[], list[bytes]]
    spoil: Mutation
    use: Callable[[bytes, Path, int], None]

    def hostile(self, seed: int, number: int) -> bytes:
        """The input with this number; the same for the same seed."""
        rng = random.Random(f"{self.name}/{seed}/{number}")
        return self.spoil(rng, rng.choice(_valid(self)))


@cache
def _valid(target: Target) -> list[bytes]:
    return target.valid()


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


def _mcaps() -> list[bytes]:
    kinds = (CompressionType.NONE, CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4)
    return [*(mcap(kind) for kind in kinds), mcap(CompressionType.NONE, chunked=False)]


def _spoil_mcap(rng: random.Random, valid: bytes) -> bytes:
    """Bytes anywhere, or the length of a record, which stands behind its kind."""
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


def _databases() -> list[bytes]:
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


def _spoil_database(rng: random.Random, valid: bytes) -> bytes:
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


def _use_bag(suffix: str) -> Callable[[bytes, Path, int], None]:
    def use(data: bytes, folder: Path, number: int) -> None:
        path = folder / f"bag{suffix}"
        path.write_bytes(data)
        (read_record, quality_report, inventory)[number % 3](path)

    return use


def _use_recover(data: bytes, folder: Path, number: int) -> None:
    path = folder / ("bag.db3" if data.startswith(b"SQLite") else "bag.mcap")
    path.write_bytes(data)
    recover(path, folder / "recovered")


def _spoil_any_bag(rng: random.Random, valid: bytes) -> bytes:
    return (_spoil_database if valid.startswith(b"SQLite") else _spoil_mcap)(rng, valid)


def _metadata() -> list[bytes]:
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / "bag", _topics())
        return [(path / "metadata.yaml").read_bytes().replace(b"bag.mcap", b"bag_0.mcap")]


def _use_metadata(data: bytes, folder: Path, number: int) -> None:
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


def _messages() -> list[bytes]:
    rows = Messages(STAMPS[:1], VALUES[:1], VALUES[:1], VALUES[:1]).serialised()
    return [rows[0].tobytes(), _own_message(), _own_message()]


def _use_message(data: bytes, folder: Path, number: int) -> None:
    """The spoilt message among whole ones, by layout and one by one: what both accept has to be equal."""
    whole = _messages()
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


def _definitions() -> list[bytes]:
    return [OWN_DEFINITION.encode()]


def _use_definition(data: bytes, folder: Path, number: int) -> None:
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


# YAML

MODEL = b"""
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.01, unit: s}}}]
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m, prior: {mean: 180.0, std: 20.0}}, rest_length: {value: 0.2, unit: m}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m, bounds: [0.0, .inf]}}
"""
SIGNALS = b"""
time: {column: t_ms, scale: 0.001}
input: {file: run.csv, column: u, kind: force, hold: zero, scale: 2.0, offset: 0.1, unit: N}
output: {file: run.csv, column: y}
forcing: {amplitude: 12.0, frequency: 61.4, phase: 0.1}
use: [0.0, 5.0]
parameters: {position_control.proportional: 12.5}
"""
TABLE = b"t_ms,u,y\n" + b"".join(b"%d,%.3f,%.3f\n" % (k, VALUES[k], VALUES[-k]) for k in range(COUNT))
EXPERIMENT = b"""
model: model.yaml
excitation: {type: sequence, parts: [{type: chirp, amplitude: 0.02, band: [0, 7], sweep: 10.0, shift: {period: 1.0, count: 6}},
  {type: multisine, rms: 0.01, period: 5.0, band: [0.5, 4.0]}, {type: profile, points: [[0, 0], [1, 0.1]], length: 2.0}]}
forcing: {amplitude: 1.0, frequency: 1.0, phase: 0.0}
delays: {input: 0.04, measurement: {profile: delays.csv}}
noise: {measurement_std: 1.0e-5, correlation: 0.1, quantisation: 1.0e-6}
time: {mode: lockstep, rate: 1000, layout: processes, window: 50}
duration: 20
seed: 3
initial: {position: 0.2, velocity: 0.0}
safety: {max_effort: 0.1, ramp: 1.0, stale_after: 0.5, envelope: [0.0, 0.4]}
record: {path: demo_bag, storage: mcap, topics: [excitation, joint_states, forcing, run]}
namespace: /hopper
joint: leg
"""
LATENCY = b"delays: {input: {value: 0.04, std: 1.7e-05}, measurement: {value: null, std: null}, sum: {value: 0.1, std: 0.01}}\nmodel:\n"


def _use_model(data: bytes, folder: Path, number: int) -> None:
    (folder / "model.yaml").write_bytes(data)
    Model.from_text(Model.load(folder / "model.yaml", _catalogue()).to_yaml(), catalogue=_catalogue())


@cache
def _catalogue() -> Catalogue:
    return load_catalogue()


def _use_signals(data: bytes, folder: Path, number: int) -> None:
    (folder / "run.csv").write_bytes(TABLE)
    (folder / "signals.yaml").write_bytes(data)
    read_record(
        folder / "run.csv", Signals.load(folder / "signals.yaml")
    ) if b"run.csv" not in data else read_record(folder / "signals.yaml")


def _use_experiment(data: bytes, folder: Path, number: int) -> None:
    (folder / "model.yaml").write_bytes(MODEL)
    (folder / "delays.csv").write_bytes(b"time,delay\n0,0.01\n5,0.02\n")
    (folder / "experiment.yaml").write_bytes(data)
    Experiment.load(folder / "experiment.yaml").nodes()


def _use_latency(data: bytes, folder: Path, number: int) -> None:
    (folder / "latency.yaml").write_bytes(data)
    Latency.load(folder / "latency.yaml")


def _latencies() -> list[bytes]:
    return [LATENCY + b"".join(b"  " + line for line in MODEL.splitlines(keepends=True))]


# Tables


def _texts() -> list[bytes]:
    semicolons = TABLE.replace(b",", b";").replace(b".", b",")
    return [
        TABLE, semicolons, TABLE.replace(b",", b"\t"), b"# t u y\n" + TABLE.replace(b",", b"  ").split(b"\n", 1)[1],
        b'"run 7"\n"t","u","note"\ns,N,-\n' + b"".join(b'%d,"%.2f","a, ""b"""\n' % (k, VALUES[k]) for k in range(COUNT)),
        TABLE.decode().encode("utf-16"), TABLE.replace(b"u", "µ".encode("cp1252")),
    ]  # fmt: skip


def _arrays() -> dict[str, np.ndarray]:
    return {"t": np.arange(COUNT) * 1e-3, "u": VALUES, "q": np.column_stack([VALUES, VALUES[::-1]])}


def _npz_parts() -> list[bytes]:
    """A member's bytes: it is spoilt before it is packed, since the archive's checksum would find it out."""
    made = []
    for array in (*_arrays().values(), np.array(["a", "b"]), np.array([{"a": 1}], dtype=object)):
        file = io.BytesIO()
        np.save(file, array, allow_pickle=True)
        made.append(file.getvalue())
    return made


def _npz(member: bytes, method: int) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        archive.writestr("t.npy", _npz_parts()[0])
        archive.writestr("u.npy", member)
    return file.getvalue()


def _spoil_npz(rng: random.Random, valid: bytes) -> bytes:
    method = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    if rng.random() < 0.7:
        return _npz(spoil_bytes(rng, valid), method)
    return spoil_bytes(rng, _npz(valid, method))


def _mats() -> list[bytes]:
    made = []
    nested = {
        **_arrays(),
        "s": {"q": VALUES, "t": {"u": 1.0}},
        "c": np.array([1, "x"], dtype=object),
        "n": "name",
    }
    for content, options in ((nested, {}), (nested, {"do_compression": True}), (_arrays(), {"format": "4"})):
        file = io.BytesIO()
        savemat(file, content, **options)
        made.append(file.getvalue())
    return [made[0], *made]


def _parquets() -> list[bytes]:
    import pyarrow as pa
    from pyarrow.parquet import write_table

    made = []
    columns = {"t": np.arange(COUNT) * 1e-3, "u": VALUES, "n": np.arange(COUNT), "w": ["a"] * COUNT}
    for compression in ("none", "snappy", "zstd"):
        file = io.BytesIO()
        write_table(pa.table(columns), file, compression=compression)
        made.append(file.getvalue())
    return made


def _use_table(suffix: str) -> Callable[[bytes, Path, int], None]:
    def use(data: bytes, folder: Path, number: int) -> None:
        path = folder / f"run{suffix}"
        path.write_bytes(data)
        inventory(path, rate=None if number % 2 else 100.0)

    return use


def _spoil_gzip(rng: random.Random, valid: bytes) -> bytes:
    if rng.random() < 0.5:
        return gzip.compress(spoil_text(rng, valid), 1)
    return spoil_bytes(rng, gzip.compress(valid, 1))


def _spoil_packed_bag(rng: random.Random, valid: bytes) -> bytes:
    return spoil_bytes(rng, compress(valid)) if rng.random() < 0.5 else compress(_spoil_mcap(rng, valid))


TARGETS = {
    target.name: target
    for target in (
        Target("mcap", _mcaps, _spoil_mcap, _use_bag(".mcap")),
        Target("mcap.zstd", _mcaps, _spoil_packed_bag, _use_bag(".mcap.zstd")),
        Target("db3", _databases, _spoil_database, _use_bag(".db3")),
        Target("metadata", _metadata, spoil_text, _use_metadata),
        Target("recover", lambda: _mcaps() + _databases() * 2, _spoil_any_bag, _use_recover),
        Target("message", _messages, spoil_bytes, _use_message),
        Target("definition", _definitions, spoil_text, _use_definition),
        Target("model", lambda: [MODEL], spoil_text, _use_model),
        Target("signals", lambda: [SIGNALS, SIGNALS.replace(b"file: run.csv, ", b"")], spoil_text, _use_signals),
        Target("experiment", lambda: [EXPERIMENT], spoil_text, _use_experiment),
        Target("latency", _latencies, spoil_text, _use_latency),
        Target("csv", _texts, spoil_text, _use_table(".csv")),
        Target("csv.gz", _texts, _spoil_gzip, _use_table(".csv.gz")),
        Target("npz", _npz_parts, _spoil_npz, _use_table(".npz")),
        Target("mat", _mats, spoil_bytes, _use_table(".mat")),
        Target("parquet", _parquets, spoil_bytes, _use_table(".parquet")),
    )
}  # fmt: skip
