"""Damaged recordings: what is whole is read, what is not is never made up, and nothing but one line is said about it."""

import os
import shutil
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType
from mcap.writer import Writer as PlainMcapWriter

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.bag_report import quality_report
from rhythmid.record.bag_writer import add_topic, new_bag, write_bag
from rhythmid.record.block import Topic
from rhythmid.record.compression import compress
from rhythmid.record.message_types import standard_types
from rhythmid.record.messages import Messages
from rhythmid.record.read import read_record
from rhythmid.record.recover import recover

N = 400
TYPE = "sensor_msgs/msg/JointState"
STAMPS = np.arange(N, dtype=np.int64) * 1_000_000
VALUES = np.random.default_rng(7).standard_normal(N)
TOPICS = {
    "/hopper/excitation": Messages(STAMPS, effort=VALUES),
    "/hopper/joint_states": Messages(STAMPS, position=VALUES),
}
KINDS = ("chunks", "zstd", "lz4", "no chunks", "db3")
IN_A_CHUNK = {
    "zstd": b"zstd",
    "lz4": b"lz4",
    "chunks": VALUES[200].tobytes(),
}  # what stands in one, not far from its end
CHECKED = ("chunks", "zstd", "lz4")  # every chunk bears a checksum


def in_small_chunks(path: Path, compression: CompressionType, chunked: bool = True) -> None:
    """The topics as an independent writer of MCAP puts them, a few messages to a chunk."""
    writer = PlainMcapWriter(str(path), chunk_size=4096, compression=compression, use_chunking=chunked)
    writer.start(profile="ros2", library="")
    definition = standard_types().generate_msgdef(TYPE, ros_version=2)[0].encode()
    schema = writer.register_schema(TYPE, "ros2msg", definition)
    rows = {writer.register_channel(name, "cdr", schema): m.serialised() for name, m in TOPICS.items()}
    for k in range(N):
        for channel, data in rows.items():
            writer.add_message(channel, int(STAMPS[k]), data[k].tobytes(), int(STAMPS[k]))
    writer.finish()


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> dict[str, bytes]:
    """The same recording, whole, in every kind of file."""
    folder = tmp_path_factory.mktemp("whole")
    in_small_chunks(folder / "chunks.mcap", CompressionType.NONE)
    in_small_chunks(folder / "zstd.mcap", CompressionType.ZSTD)
    in_small_chunks(folder / "lz4.mcap", CompressionType.LZ4)
    in_small_chunks(folder / "no chunks.mcap", CompressionType.NONE, chunked=False)
    write_bag(folder / "db3", TOPICS, storage="sqlite3")
    shutil.copy(folder / "db3" / "db3.db3", folder / "db3.db3")
    return {kind: (folder / file_name(kind)).read_bytes() for kind in KINDS}


def file_name(kind: str) -> str:
    return "db3.db3" if kind == "db3" else f"{kind}.mcap"


def read_all(path: Path) -> tuple[dict[str, np.ndarray], Bag]:
    """Values of every topic in the order of the file."""
    found: dict[str, list[float]] = {}
    bag = Bag(path)
    store = standard_types()
    for block in bag.blocks():
        for data in block:
            message = store.deserialize_cdr(data, TYPE)
            value = (*message.position, *message.effort)
            found.setdefault(block.topic.name, []).append(value[0])
    return {name: np.array(values) for name, values in found.items()}, bag


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("spoilt")


def says_one_line(error: InputError) -> bool:
    text = str(error)
    return bool(text) and "\n" not in text and len(text) < 600


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_file_is_read_whole(kind, whole, place):
    (place / file_name(kind)).write_bytes(whole[kind])
    found, bag = read_all(place / file_name(kind))
    assert not bag.truncated and not bag.notes
    for name in TOPICS:
        np.testing.assert_array_equal(found[name], VALUES)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=60)
@given(share=st.floats(0.0, 1.0, exclude_max=True))
def test_of_a_file_that_breaks_off_anywhere_the_beginning_is_read(kind, whole, place, share):
    cut = int(share * len(whole[kind]))
    path = place / f"cut.{file_name(kind)}"
    path.write_bytes(whole[kind][:cut])
    try:
        found, bag = read_all(path)
    except InputError as error:
        assert says_one_line(error)
        assert cut < 8 or kind == "db3"  # an MCAP file is one from its eighth byte on
        return
    finished = kind != "db3" and cut > len(whole[kind]) - 37  # only the footer is touched
    assert bag.truncated or finished
    for name, values in found.items():
        assert name in TOPICS
        np.testing.assert_array_equal(values, VALUES[: len(values)])
    if kind == "no chunks" and cut > 5000:
        assert len(found["/hopper/joint_states"]) > 0.8 * (cut - 5000) / len(whole[kind]) * N


def test_of_a_database_that_breaks_off_in_the_middle_much_is_read(whole, place):
    path = place / "half.db3"
    path.write_bytes(whole["db3"][: int(0.7 * len(whole["db3"]))])
    before = path.read_bytes()
    record = read_record(path)
    assert 0.3 * N < len(record.output) < N and record.quality.truncated
    np.testing.assert_array_equal(record.output.value, VALUES[: len(record.output)])
    assert path.read_bytes() == before  # the recording itself is never changed


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=25)
@given(data=st.data())
def test_damage_anywhere_is_survived(kind, whole, place, data):
    spoilt = bytearray(whole[kind])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(spoilt) - 1))
        piece = data.draw(st.binary(min_size=1, max_size=16))
        spoilt[at : at + len(piece)] = piece
    path = place / f"damaged.{file_name(kind)}"
    path.write_bytes(spoilt)
    for use in (read_record, quality_report, lambda p: recover(p, place / "mended")):
        shutil.rmtree(place / "mended", ignore_errors=True)
        try:
            use(path)
        except InputError as error:
            assert says_one_line(error)


@pytest.mark.parametrize("kind", CHECKED)
@settings(max_examples=60)
@given(share=st.floats(0.05, 0.85), flipped=st.integers(1, 255))
def test_no_value_is_made_up_where_a_checksum_guards_it(kind, whole, place, share, flipped):
    spoilt = bytearray(whole[kind])
    spoilt[int(share * len(spoilt))] ^= flipped
    path = place / f"flipped.{file_name(kind)}"
    path.write_bytes(spoilt)
    try:
        found, bag = read_all(path)
    except InputError as error:
        assert says_one_line(error)
        return
    lost = sum(N - len(values) for values in found.values())
    assert lost == 0 or bag.notes  # what is missing is told
    for values in found.values():
        assert np.isin(values, VALUES).all()


@pytest.mark.parametrize("kind", IN_A_CHUNK)
def test_a_damaged_chunk_is_skipped_told_and_the_rest_recovered(kind, whole, place):
    spoilt = bytearray(whole[kind])
    at = spoilt.index(IN_A_CHUNK[kind], len(spoilt) // 3) + (0 if kind == "chunks" else 60)
    spoilt[at : at + 8] = bytes(8)
    path = place / "chunk.mcap"
    path.write_bytes(spoilt)
    shutil.rmtree(place / "mended", ignore_errors=True)
    mended = recover(path, place / "mended")
    assert any("is damaged" in note for note in mended.notes), mended.notes
    assert 0.5 * N < mended.counts["/hopper/joint_states"] < N
    found, bag = read_all(place / "mended")
    assert not bag.truncated and np.isin(found["/hopper/joint_states"], VALUES).all()


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
class TestDirectories:
    """A bag is a folder with metadata.yaml and storage files; people move, lose, compress and rename these."""

    @pytest.fixture
    def made(self, tmp_path, storage) -> Path:
        return write_bag(tmp_path / "bag", TOPICS, storage=storage)

    @staticmethod
    def file(bag: Path) -> Path:
        return next(file for file in bag.iterdir() if file.name != "metadata.yaml")

    def test_without_metadata_all_files_are_read(self, made):
        (made / "metadata.yaml").unlink()
        record = read_record(made)
        np.testing.assert_array_equal(record.output.value, VALUES)
        assert "metadata.yaml is missing: the recorder was not closed" in record.quality.notes

    def test_a_file_alone_is_a_bag(self, made, tmp_path):
        alone = tmp_path / self.file(made).name
        shutil.move(self.file(made), alone)
        np.testing.assert_array_equal(read_record(alone).output.value, VALUES)

    @pytest.mark.parametrize("text", ["", "[", "rosbag2_bagfile_information: 3", "\0"])
    def test_with_damaged_metadata_all_files_are_read(self, made, text):
        (made / "metadata.yaml").write_text(text)
        record = read_record(made)
        np.testing.assert_array_equal(record.output.value, VALUES)
        assert any("metadata.yaml is damaged" in note for note in record.quality.notes)

    def test_a_missing_file_is_named(self, made):
        name = self.file(made).name
        self.file(made).rename(made / f"other{self.file(made).suffix}")
        with pytest.raises(InputError, match=f"{name}, which metadata.yaml lists, is missing"):
            read_record(made)

    def test_a_file_compressed_as_a_whole_is_read(self, made):
        file = self.file(made)
        packed = file.with_name(file.name + ".zstd")
        packed.write_bytes(compress(file.read_bytes()))
        metadata = (made / "metadata.yaml").read_text()
        (made / "metadata.yaml").write_text(metadata.replace(file.name, packed.name))
        file.unlink()
        np.testing.assert_array_equal(read_record(made).output.value, VALUES)
        np.testing.assert_array_equal(read_record(packed).output.value, VALUES)

    def test_a_compressed_file_that_is_none_is_refused(self, made):
        file = self.file(made)
        packed = file.with_name(file.name + ".zstd")
        packed.write_bytes(b"not compressed at all")
        with pytest.raises(InputError, match="cannot be decompressed"):
            read_record(packed)

    def test_a_split_recording_is_read_in_its_order(self, made, tmp_path, storage):
        half = N // 2
        parts = [
            {name: Messages(m.stamp_ns[part], **{f: c[part] for f in ("position", "effort") if (c := getattr(m, f)) is not None})
             for name, m in TOPICS.items()}
            for part in (slice(0, half), slice(half, N))
        ]  # fmt: skip
        whole = tmp_path / "split"
        whole.mkdir()
        for number, topics in enumerate(parts):
            piece = write_bag(tmp_path / f"part{number}", topics, storage=storage)
            file = self.file(piece)
            shutil.copy(file, whole / f"split_{9 + number}{file.suffix}")  # 10 after 9, not before
        np.testing.assert_array_equal(read_record(whole).output.value, VALUES)

    def test_messages_compressed_one_by_one_are_read(self, tmp_path, storage):
        with new_bag(tmp_path / "packed", storage) as writer:
            for name, messages in TOPICS.items():
                topic = add_topic(writer, name, TYPE)
                for stamp, row in zip(STAMPS.tolist(), messages.serialised()):
                    writer.write(topic, stamp, compress(row.tobytes()))
        np.testing.assert_array_equal(read_record(tmp_path / "packed").output.value, VALUES)


@pytest.mark.parametrize(
    ("name", "begin"), [("vast.mcap", b"\x89MCAP0\r\n"), ("vast.db3", b"SQLite format 3\0")]
)
def test_a_vast_file_of_zeros_is_refused_at_once(tmp_path, name, begin):
    path = tmp_path / name
    path.write_bytes(begin)
    os.truncate(path, 2**30)  # takes no room on the disk
    with pytest.raises(InputError) as error:
        read_record(path)
    assert says_one_line(error.value)


def test_a_chunk_that_claims_to_be_vast_is_not_believed(whole, place):
    spoilt = bytearray(whole["lz4"])
    at = spoilt.index(b"lz4") - 4 - 12  # the uncompressed size, before checksum and method
    spoilt[at : at + 8] = (2**62).to_bytes(8, "little")
    path = place / "vast.mcap"
    path.write_bytes(spoilt)
    record = read_record(path)
    assert len(record.output) < N and any("is damaged" in note for note in record.quality.notes)


def test_a_frame_of_lz4_that_breaks_off_gives_what_precedes():
    assert lz4.frame.decompress(lz4.frame.compress(b"x")) == b"x"  # the library is what we think it is
    from rhythmid.record.compression import decompress

    packed = lz4.frame.compress(os.urandom(300_000))
    assert 0 < len(decompress(packed[:200_000], "lz4")) < 300_000
    with pytest.raises(ValueError):
        decompress(b"no frame", "lz4")
    with pytest.raises(ValueError, match="unknown compression"):
        decompress(b"", "rar")


def test_a_type_that_changes_within_a_topic_is_refused(tmp_path):
    path = tmp_path / "two.mcap"
    writer = PlainMcapWriter(str(path))
    writer.start(profile="ros2", library="")
    for msgtype in (TYPE, "std_msgs/msg/Float64"):
        text = standard_types().generate_msgdef(msgtype, ros_version=2)[0].encode()
        number = writer.register_schema(msgtype, "ros2msg", text)
        channel = writer.register_channel("/hopper/joint_states", "cdr", number)
        writer.add_message(channel, 0, Messages(STAMPS[:1], position=VALUES[:1]).serialised()[0].tobytes(), 0)
    writer.finish()
    with pytest.raises(InputError, match="carries both|is not in"):
        read_record(path)


@pytest.mark.parametrize(
    ("topic", "words"),
    [
        (Topic("/t", "sensor_msgs/msg/JointState", "json"), "encoded as 'json'"),
        (Topic("/t", "my_robot/msg/State"), "does not define its type 'my_robot/msg/State'"),
    ],
)
def test_what_cannot_be_deserialised_is_said(topic, words):
    from rhythmid.record.message_types import type_fields

    with pytest.raises(InputError, match=words):
        type_fields(topic)


def test_metadata_lists_what_is_in_the_folder(tmp_path):
    made = write_bag(tmp_path / "bag", TOPICS)
    listed = yaml.safe_load((made / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert listed["message_count"] == 2 * N and listed["relative_file_paths"] == ["bag.mcap"]
