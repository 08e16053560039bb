"""Writes sqlite3 bags by whole arrays of messages, with checksums."""

import sqlite3
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.errors import WriterError
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

CHECKSUMS = "CREATE TABLE checksums(last_id INTEGER PRIMARY KEY, crc32 INTEGER NOT NULL)"
"""A table of ours, which rosbag2 passes over: sqlite itself would not notice that a number in a message has changed.

`crc32` covers the messages behind those of the previous row up to `last_id`.
"""

_SUMMED = 1000  # messages of one checksum at most: a flipped bit costs as many in a recovery


def checksum(topic: int, timestamp: int, data: bytes | memoryview, before: int) -> int:
    """CRC-32 continued by one message: its topic's number, receive time [ns] and bytes."""
    return zlib.crc32(data, zlib.crc32(struct.pack("<qq", topic, timestamp), before))


class SqliteWriter(Sqlite3Writer):
    """rosbags' sqlite3 storage with `write_arrays` and `flush`, as in `McapWriter`."""

    def __init__(self, path: Path, compression: CompressionMode, name: str) -> None:
        if compression == CompressionMode.STORAGE:
            raise WriterError("sqlite3 files cannot be compressed in themselves; use mcap")
        self.path = path / f"{name}.db3"
        self.conn = sqlite3.connect(self.path)
        self.conn.executescript(self.SQLITE_SCHEMA + CHECKSUMS)
        self.cursor = self.conn.cursor()
        self._checksum, self._summed, self._written = 0, 0, 0

    def write(
        self, connection: Connection, timestamp: int, data: bytes | memoryview, sent_ns: int = 0
    ) -> None:
        """Write one message with its receive time [ns]; rosbag2's tables (schema version 4) have no place for `sent_ns`."""
        super().write(connection, timestamp, data)
        self._sum(connection.id, timestamp, data)

    def write_arrays(self, parts: Sequence[tuple[int, NDArray[np.int64], NDArray[np.uint8]]]) -> None:
        """Write the messages of several topics in order of receive time.

        Each part is a topic's number, receive times int64[n] [ns] and equally long messages uint8[n, size].
        """
        rows = [
            (topic, time, data)
            for topic, log_ns, block in parts
            for time, data in zip(log_ns.tolist(), map(bytes, block), strict=True)
        ]
        order = np.argsort(np.concatenate([log_ns for _, log_ns, _ in parts]), kind="stable").tolist()
        self.cursor.executemany(
            "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
            (rows[index] for index in order),
        )
        for index in order:
            self._sum(*rows[index])

    def _sum(self, topic: int, timestamp: int, data: bytes | memoryview) -> None:
        self._checksum = checksum(topic, timestamp, data, self._checksum)
        self._written += 1
        if self._written - self._summed >= _SUMMED:
            self._keep_checksum()

    def _keep_checksum(self) -> None:
        self.cursor.execute("INSERT INTO checksums VALUES (?, ?)", (self._written, self._checksum))
        self._checksum, self._summed = 0, self._written

    def flush(self) -> None:
        """Commit everything written so far."""
        if self._written > self._summed:
            self._keep_checksum()
        self.conn.commit()

    def close(self, version: int, metadata: str) -> None:
        """Write the metadata and close the file."""
        self.flush()
        super().close(version, metadata)
