"""Bags made to do harm: refused in one line or read, in little time and memory, and nothing in them is carried out."""

import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from refusals import refusal

from rhythmid.record import compression
from rhythmid.record.bag import Bag
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.compression import compress
from rhythmid.record.messages import Messages

ZEROS = b"\0" * (1 << 20)


@pytest.mark.parametrize(
    "listed", ["[metadata.yaml]", "[../../etc/passwd]", "[x.zstd]", "[" + "x" * 5000 + ".mcap]", "!!timestamp x", "7", "[[" * 3000]
)  # fmt: skip
def test_metadata_that_names_anything_else_is_damaged_metadata(listed, tmp_path):
    bag = write_bag(tmp_path / "bag", {"/a": Messages(np.arange(9), np.arange(9.0))})
    (bag / "metadata.yaml").write_text(f"rosbag2_bagfile_information: {{relative_file_paths: {listed}}}")
    found = Bag(bag)
    assert [file.name for file in found.files] == ["bag.mcap"] and "metadata.yaml is damaged" in found.notes[
        0
    ]


def test_files_are_put_in_order_whatever_digits_their_names_hold(tmp_path):
    for name in ("²1.mcap", "2.mcap", "10.mcap"):
        (tmp_path / name).write_bytes(b"")
    assert [file.name for file in Bag(tmp_path).files] == ["2.mcap", "10.mcap", "²1.mcap"]


def chunk(plain_size: int, method: bytes, packed: bytes) -> bytes:
    body = (
        struct.pack("<QQQI", 0, 0, plain_size, 0)
        + struct.pack("<I", len(method))
        + method
        + struct.pack("<Q", len(packed))
        + packed
    )
    return b"\x89MCAP0\r\n" + b"\x06" + struct.pack("<Q", len(body)) + body


@pytest.mark.parametrize("method", ["zstd", "lz4"])
def test_a_chunk_that_would_fill_the_memory_is_skipped_and_told(method, tmp_path, monkeypatch, bounded):
    monkeypatch.setattr(compression, "HARMLESS", 1 << 20)
    packed = compress(ZEROS * 64) if method == "zstd" else lz4.frame.compress(ZEROS * 64)
    monkeypatch.setattr(compression, "EXPANSION", 8)
    (tmp_path / "bomb.mcap").write_bytes(chunk(64 << 20, method.encode(), packed))
    bag = Bag(tmp_path / "bomb.mcap")
    assert not list(bag.blocks())
    assert "it holds more than" in bag.notes[0]


def test_a_packed_bag_that_would_fill_the_disk_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(compression, "HARMLESS", 1 << 20)
    (tmp_path / "bomb.mcap.zstd").write_bytes(compress(ZEROS * 64))
    assert "cannot be decompressed: it holds more than" in refusal(
        lambda: list(Bag(tmp_path / "bomb.mcap.zstd").blocks())
    )


@pytest.mark.parametrize("size", [0, 21, 2**60, 2**64 - 1])
def test_a_message_that_is_too_short_or_of_any_length_ends_the_file_at_most(size, tmp_path, bounded):
    (tmp_path / "a.mcap").write_bytes(b"\x89MCAP0\r\n\x05" + struct.pack("<Q", size) + bytes(min(size, 21)))
    bag = Bag(tmp_path / "a.mcap")
    assert not list(bag.blocks()) and bag.truncated


def database(path: Path, statement: str) -> Path:
    bag = write_bag(path / "bag", {"/a": Messages(np.arange(9), np.arange(9.0))}, storage="sqlite3")
    with closing(sqlite3.connect(bag / "bag.db3")) as open_:
        open_.executescript(statement)
    return bag


def test_a_database_that_computes_gigabytes_is_refused(tmp_path, bounded):
    bag = database(
        tmp_path,
        "DROP TABLE messages; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
        " data BLOB GENERATED ALWAYS AS (zeroblob(999999999)));"
        "INSERT INTO messages(topic_id, timestamp) VALUES (1, 1), (1, 2), (1, 3)",
    )
    assert "not a readable sqlite3 bag" in refusal(lambda: list(Bag(bag).blocks()))


def test_large_messages_of_a_database_are_fetched_few_at_once(tmp_path, bounded):
    bag = database(tmp_path, f"UPDATE messages SET data = zeroblob({32 << 20})")
    assert max(len(block) for block in Bag(bag).blocks()) <= 3


@pytest.mark.parametrize("cell", ["NULL", "x'00'", "7"])
def test_a_database_whose_definitions_are_no_texts_is_refused(cell, tmp_path):
    bag = database(
        tmp_path,
        "CREATE TABLE IF NOT EXISTS x(a); UPDATE message_definitions SET encoding = 'ros2msg';"
        "DROP TABLE message_definitions; CREATE TABLE message_definitions(topic_type, encoding, encoded_message_definition);"
        f"INSERT INTO message_definitions VALUES ('sensor_msgs/msg/JointState', 'ros2msg', {cell})",
    )
    assert "holds no texts" in refusal(lambda: list(Bag(bag).blocks()))


def leaves(data: bytes, root: int, page: int) -> list[int]:
    """Where the leaves of a table's tree begin (https://sqlite.org/fileformat.html#b_tree_pages), for a tree of two levels."""
    at = (root - 1) * page
    assert data[at] == 5
    (cells,) = struct.unpack_from(">H", data, at + 3)
    places = struct.unpack_from(f">{cells}H", data, at + 12)
    return [(struct.unpack_from(">I", data, at + place)[0] - 1) * page for place in places]


def test_a_database_that_leads_to_the_same_row_again_and_again_comes_to_an_end(tmp_path, bounded):
    times = 10 * np.arange(400)
    topics = {"/a": Messages(times, times * 1.0), "/b": Messages(times[1:] + 5, times[1:] * 1.0)}
    path = write_bag(tmp_path / "bag", topics, storage="sqlite3") / "bag.db3"
    with closing(sqlite3.connect(path)) as open_:
        (page,), (root,) = (
            open_.execute("PRAGMA page_size").fetchone(),
            open_.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone(),
        )
    data = bytearray(path.read_bytes())
    first, second, *_ = leaves(data, root, page)
    (cells,) = struct.unpack_from(">H", data, first + 3)
    data[first + 8 : first + 8 + 2 * cells] = data[first + 8 : first + 10] * cells  # each row is the first
    data[second] = 0xFF  # and behind them is nothing that could be read
    path.write_bytes(data)
    bag = Bag(path)
    assert sum(map(len, bag.blocks(lambda topic: topic.name == "/b"))) > 100
    assert any("are lost" in note for note in bag.notes)
