"""Damaged bags recovered: everything whole comes back, what was lost is listed, and no damage passes unnoticed."""

import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from read_back import by_us, require_readable_by_others

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.bag_report import quality_report
from rhythmid.record.bag_writer import BagWriter, add_topic, new_bag, write_bag
from rhythmid.record.mcap_writer import CHUNK
from rhythmid.record.messages import Messages
from rhythmid.record.recover import recover

N, PART = 600, 60  # messages of each topic, and those between two flushes
STAMPS = np.arange(N, dtype=np.int64) * 1_000_000
VALUES = np.random.default_rng(11).standard_normal(N)
TOPICS = {
    "/hopper/excitation": Messages(STAMPS, effort=VALUES),
    "/hopper/joint_states": Messages(STAMPS, position=VALUES),
}
STORAGES = ("mcap", "sqlite3")


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> dict[str, Path]:
    """The same recording in both kinds of storage, flushed ten times, as a recorder does."""
    made = {}
    for storage in STORAGES:
        made[storage] = tmp_path_factory.mktemp(storage) / "bag"
        writer = BagWriter(made[storage], storage, numbered=True)
        writer.open()
        rows = [
            (add_topic(writer, name, "sensor_msgs/msg/JointState"), m.serialised())
            for name, m in TOPICS.items()
        ]
        for k in range(N):
            for connection, data in rows:
                writer.write(connection, int(STAMPS[k]), data[k].tobytes())
            if k % PART == PART - 1:
                writer.flush()
        writer.close()
    return made


@pytest.fixture
def spoilt(whole, tmp_path):
    """spoilt(storage, change): a copy of the recording whose storage file `change(bytearray)` has damaged."""

    def make(storage, change) -> Path:
        bag = tmp_path / "spoilt"
        shutil.rmtree(bag, ignore_errors=True)
        shutil.copytree(whole[storage], bag)
        (file,) = bag.glob("bag_0.*")
        data = bytearray(file.read_bytes())
        file.write_bytes(change(data) or data)
        return bag

    return make


def chunks(data: bytes) -> list[int]:
    """Where the chunks of an MCAP file begin."""
    found, at = [], 8
    while at < len(data) - 8:
        op, size = struct.unpack_from("<BQ", data, at)
        if op == CHUNK:
            found.append(at)
        at += 9 + size
    return found


@pytest.mark.parametrize("storage", STORAGES)
@settings(max_examples=25)
@given(share=st.floats(0.0, 1.0, exclude_max=True), flipped=st.integers(0, 7))
def test_a_flipped_bit_is_told_or_changes_nothing(storage, whole, share, flipped, tmp_path_factory):
    bag = tmp_path_factory.mktemp("flipped") / "bag"
    shutil.copytree(whole[storage], bag)
    (file,) = bag.glob("bag_0.*")
    data = bytearray(file.read_bytes())
    data[int(share * len(data))] ^= 1 << flipped
    file.write_bytes(data)
    try:
        report = quality_report(bag)
    except InputError:
        return
    if not report.damage and report.usable:
        assert storage == "sqlite3" and by_us(bag) == by_us(whole[storage])
    elif report.damage:
        assert not any(line.endswith(": flawless") for line in report.lines())
    shutil.rmtree(bag)


@pytest.mark.parametrize("broken", [0, 4096], ids=["whole end", "without its last page"])
@pytest.mark.parametrize("storage", STORAGES)
def test_what_is_recovered_was_written_so_and_the_rest_is_counted(storage, broken, spoilt, whole, tmp_path):
    def change(data):
        data[data.index(VALUES[N // 2].tobytes()) + 3] ^= 1
        return data[: len(data) - broken]

    done = recover(spoilt(storage, change), tmp_path / "out")
    written, kept = by_us(whole[storage]), by_us(tmp_path / "out")
    assert set(kept) < set(written) and done.notes
    assert 2 * N - 2 * PART - broken / 50 <= len(kept) == 2 * N - sum(done.lost.values())
    assert quality_report(tmp_path / "out").damage == ()


def test_a_flipped_bit_of_a_long_database_costs_a_thousand_messages_at_most(tmp_path):
    number = 4000
    rows = Messages(np.arange(number, dtype=np.int64) * 1_000_000, effort=np.arange(number) + 0.5)
    bag = write_bag(tmp_path / "bag", {"/excitation": rows}, storage="sqlite3")
    (file,) = bag.glob("*.db3")
    data = bytearray(file.read_bytes())
    data[data.index(np.float64(2500.5).tobytes())] ^= 1
    file.write_bytes(data)
    done = recover(bag, tmp_path / "out")
    assert done.counts["/excitation"] == number - 1000 and done.lost["/excitation"] == 1000


@pytest.mark.parametrize("storage", STORAGES)
def test_a_whole_bag_is_said_to_be_whole_and_recovered_as_it_is(storage, whole, tmp_path):
    assert quality_report(whole[storage]).damage == ()
    done = recover(whole[storage], tmp_path / "out")
    assert not done.notes and not done.lost
    assert sorted(by_us(tmp_path / "out")) == sorted(by_us(whole[storage]))
    require_readable_by_others(tmp_path / "out")


@pytest.mark.parametrize("damage", ["length", "content", "header"])
def test_behind_a_broken_chunk_the_next_one_is_found_and_the_loss_is_counted(damage, spoilt, whole, tmp_path):
    def change(data):
        at = chunks(data)[4]
        place = {"length": at + 3, "content": at + 2000, "header": at + 40}[damage]
        data[place] ^= 0xFF

    bag = spoilt("mcap", change)
    done = recover(bag, tmp_path / "out")
    assert dict(done.lost) == dict.fromkeys(TOPICS, PART)
    assert any("damaged" in note for note in done.notes)
    kept = sorted(by_us(tmp_path / "out"))
    expected = [row for row in sorted(by_us(whole["mcap"])) if not 4 * PART <= row[1] / 1e6 < 5 * PART]
    assert kept == expected
    require_readable_by_others(tmp_path / "out")


BEGINNINGS = {  # what stands in the place of the first bytes of a file
    "zeros": bytes(1024),
    "another file": b"PK\x03\x04" + bytes(range(252)) * 4,
    "no magic": bytes(8),
    "a header too long": b"\x89MCAP0\r\n\x01" + struct.pack("<Q", 300),
}


@pytest.mark.parametrize("beginning", BEGINNINGS)
def test_a_file_whose_beginning_is_damaged_is_read_from_its_first_whole_chunk_on(
    beginning, spoilt, whole, tmp_path
):
    bag = spoilt("mcap", lambda data: BEGINNINGS[beginning] + data[len(BEGINNINGS[beginning]) :])
    done = recover(bag, tmp_path / "out")
    first = 0 if len(BEGINNINGS[beginning]) < 20 else PART  # a chunk with a wrong checksum is left out
    assert any("first" in note and "damaged" in note for note in done.notes)
    assert dict(done.lost) == (dict.fromkeys(TOPICS, first) if first else {})
    assert sorted(by_us(tmp_path / "out")) == [
        row for row in sorted(by_us(whole["mcap"])) if row[1] / 1e6 >= first
    ]
    require_readable_by_others(tmp_path / "out")


def test_messages_whose_topic_nothing_names_any_more_are_counted(spoilt, tmp_path):
    bag = spoilt("mcap", lambda data: bytes(1024) + data[1024 : chunks(data)[5]])
    (bag / "metadata.yaml").unlink()
    with pytest.raises(InputError, match="no readable message"):
        recover(bag, tmp_path / "out")
    (note,) = [note for note in quality_report(bag).notes if "channel 1" in note]
    assert f"{4 * PART} messages" in note and "lost" in note


@pytest.mark.parametrize("beginning", ["zeros", "another file", "no magic", "a page"])
def test_a_database_whose_beginning_is_damaged_is_read_page_by_page(beginning, spoilt, whole, tmp_path):
    bytes_ = BEGINNINGS.get(beginning, bytes(4096))
    done = recover(spoilt("sqlite3", lambda data: bytes_ + data[len(bytes_) :]), tmp_path / "out")
    assert not done.lost and any("page by page" in note for note in done.notes)
    assert sorted(by_us(tmp_path / "out")) == sorted(by_us(whole["sqlite3"]))
    require_readable_by_others(tmp_path / "out")


def test_a_database_without_its_beginning_and_a_page_more_tells_what_it_lost(spoilt, whole, tmp_path):
    def change(data):
        at = data.index(VALUES[N // 2].tobytes()) // 4096 * 4096
        data[at : at + 4096] = data[:4096] = bytes(4096)

    done = recover(spoilt("sqlite3", change), tmp_path / "out")
    assert 0 < sum(done.lost.values()) < 100 and any("are lost" in note for note in done.notes)
    kept, sent = by_us(tmp_path / "out"), set(by_us(whole["sqlite3"]))
    assert set(kept) < sent and len(kept) == 2 * N - sum(done.lost.values())


def test_rows_longer_than_a_page_come_back_from_a_damaged_database(tmp_path):
    with new_bag(tmp_path / "bag", "sqlite3") as writer:
        connection = add_topic(writer, "/text", "std_msgs/msg/String")
        sent = [bytes([0, 1, 0, 0]) + np.random.default_rng(k).bytes(1500 * k) for k in range(12)]
        for k, data in enumerate(sent):
            writer.write(connection, k, data)
    (file,) = (tmp_path / "bag").glob("*.db3")
    file.write_bytes(bytes(4096) + file.read_bytes()[4096:])
    assert [data for block in Bag(tmp_path / "bag").blocks() for data in block] == sent


def test_of_a_database_with_a_broken_page_all_other_pages_are_read(spoilt, whole, tmp_path):
    def change(data):
        at = data.index(VALUES[N // 2].tobytes()) // 4096 * 4096  # a page of messages in the middle
        data[at : at + 4096] = b"\xff" * 4096

    done = recover(spoilt("sqlite3", change), tmp_path / "out")
    assert 0 < sum(done.lost.values()) < 100
    assert any("are lost: " in note for note in done.notes)
    kept, sent = by_us(tmp_path / "out"), set(by_us(whole["sqlite3"]))
    assert set(kept) < sent and len(kept) == 2 * N - sum(done.lost.values())


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_without_its_end_gives_what_precedes(storage, spoilt, whole, tmp_path):
    bag = spoilt(storage, lambda data: data[: int(0.7 * len(data))])
    done = recover(bag, tmp_path / "out")
    assert sum(done.lost.values()) == 2 * N - sum(done.counts.values()) > 0
    assert set(by_us(tmp_path / "out")) < set(by_us(whole[storage]))


class TestCommand:
    """`rhythmid recover BAG [--out DIR]`."""

    def test_it_says_what_was_recovered_and_what_was_lost(self, command, spoilt):
        bag = spoilt("mcap", lambda data: data[: int(0.7 * len(data))])
        answer = command("recover", bag)
        assert answer.code == 0, answer
        assert f"{bag}_recovered: " in answer.out and " lost" in answer.out and "breaks off" in answer.out
        assert command("check", f"{bag}_recovered").out.count("flawless") == 2
        assert "files are damaged" in command("check", bag).out

    def test_a_place_that_is_taken_is_refused(self, refused, spoilt, tmp_path):
        bag = spoilt("mcap", lambda data: data)
        (tmp_path / "taken").mkdir()
        assert "exists already" in refused("recover", bag, "--out", tmp_path / "taken")

    def test_what_holds_nothing_is_refused_and_leaves_nothing(self, refused, tmp_path):
        (tmp_path / "empty.mcap").write_bytes(b"")
        refused("recover", tmp_path / "empty.mcap")
        refused("recover", tmp_path / "nothing")
        assert {path.name for path in tmp_path.iterdir()} == {"empty.mcap"}
