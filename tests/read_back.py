"""Bags read back by others: `rosbags` and `mcap`, message by message."""

from __future__ import annotations

from pathlib import Path

from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from rhythmid.record.bag import Bag

Row = tuple[str, int, bytes]  # topic, receive time [ns], serialised message
TYPES = get_typestore(Stores.ROS2_JAZZY)


def by_us(bag: Path) -> list[Row]:
    """Every message of a bag, as this project reads it."""
    return [
        (block.topic.name, time, data)
        for block in Bag(bag).blocks()
        for time, data in zip(block.log_ns.tolist(), block, strict=True)
    ]


def by_rosbags(bag: Path) -> list[Row]:
    """Every message of a bag, as rosbags reads it; each must be as long as its type says."""
    rows = []
    with Reader(bag) as reader:
        for connection, time, data in reader.messages():
            message = TYPES.deserialize_cdr(data, connection.msgtype)
            again = TYPES.serialize_cdr(message, connection.msgtype)
            assert len(again) == len(data), (
                connection.topic,
                time,
            )  # padding may differ, trailing bytes may not be
            rows.append((connection.topic, time, bytes(data)))
        assert len(rows) == reader.message_count
    return rows


def by_mcap(bag: Path) -> list[Row]:
    """Every message of a bag's MCAP files, as the reference implementation reads them, by their index."""
    rows = []
    for path in sorted(bag.glob("*.mcap")):
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            assert summary is not None and summary.statistics is not None
            before = len(rows)
            for _, channel, message in reader.iter_messages():
                rows.append((channel.topic, message.log_time, message.data))
            assert len(rows) - before == summary.statistics.message_count
    return rows


def require_readable_by_others(bag: Path) -> None:
    """Fails unless rosbags and mcap find in a closed bag exactly what this project finds."""
    ours = sorted(by_us(bag))
    assert sorted(by_rosbags(bag)) == ours
    if any(bag.glob("*.mcap")):
        assert sorted(by_mcap(bag)) == ours
