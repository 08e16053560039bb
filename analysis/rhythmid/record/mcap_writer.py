"""MCAP files written by whole arrays of messages (format: https://mcap.dev/spec).

`McapWriter` is a storage plugin of rosbags' Writer, which writes metadata.yaml. It adds `write_arrays`, and
`flush`, after which all data written so far is readable even if the process is killed.
"""

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag2.enums import CompressionMode

from rhythmid.record.compression import compress

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 0x0B, 0x0C, 0x0D, 0x0E, 0x0F
_FOOTER_SIZE = 8 + 8 + 4  # bytes after opcode and length
CHUNK_SIZE = 2**20  # bytes of messages in one chunk
MESSAGE_HEAD = np.dtype(
    [
        ("op", "u1"),
        ("size", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log", "<u8"),
        ("publish", "<u8"),
    ]
)


def record(op: int, *parts: bytes) -> bytes:
    """One MCAP record."""
    body = b"".join(parts)
    return struct.pack("<BQ", op, len(body)) + body


def text(value: str) -> bytes:
    """A length-prefixed string."""
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def message_records(channel: int, log_ns: NDArray[np.int64], data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Message records of equally long messages: data uint8[n, size] -> uint8[n, 31 + size]."""
    head = np.zeros(len(data), dtype=MESSAGE_HEAD)
    head["op"] = MESSAGE
    head["size"] = MESSAGE_HEAD.itemsize - 9 + data.shape[1]
    head["channel"] = channel
    head["log"] = head["publish"] = log_ns
    return np.hstack([head.view(np.uint8).reshape(-1, MESSAGE_HEAD.itemsize), data])


class McapWriter:
    """Storage plugin for `rosbags.rosbag2.Writer`: one indexed MCAP file in chunks with checksums."""

    def __init__(self, path: Path, compression: CompressionMode, name: str) -> None:
        self.path = path / f"{name}.mcap"
        self._file = self.path.open("xb")
        self._checksum = 0  # of all bytes written so far
        self._method = "zstd" if compression == CompressionMode.STORAGE else ""
        self._schemas: dict[str, int] = {}
        self._declared: list[bytes] = []  # schema and channel records, which the summary repeats
        self._undeclared = bytearray()  # declarations to be written with the next chunk
        self._counts: dict[int, int] = {}
        self._chunk_index: list[bytes] = []
        self._first_ns, self._last_ns = 2**63 - 1, 0
        self._single = bytearray()  # message records to be written with the next chunk
        self._single_rows: list[tuple[int, int, int]] = []  # their log times, channels and offsets
        self._write(MAGIC + record(HEADER, text("ros2"), text("rhythmid")))
        self._file.flush()

    def _write(self, data: bytes | bytearray) -> int:
        self._checksum = zlib.crc32(data, self._checksum)
        return self._file.write(data)

    def add_msgtype(self, connection: Connection) -> None:
        """Declare a message type."""
        self._schemas[connection.msgtype] = number = len(self._schemas) + 1
        encoding = "ros2msg" if connection.msgdef.format == MessageDefinitionFormat.MSG else "ros2idl"
        parts = (
            struct.pack("<H", number),
            text(connection.msgtype),
            text(encoding),
            text(connection.msgdef.data),
        )
        self._declare(record(SCHEMA, *parts))

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """Declare a topic."""
        metadata = text("offered_qos_profiles") + text(offered_qos_profiles)
        ext: Any = connection.ext
        self._counts[connection.id] = 0
        self._declare(
            record(
                CHANNEL,
                struct.pack("<HH", connection.id, self._schemas[connection.msgtype]),
                text(connection.topic),
                text(ext.serialization_format),
                struct.pack("<I", len(metadata)),
                metadata,
            )
        )

    def _declare(self, declaration: bytes) -> None:
        self._declared.append(declaration)
        self._undeclared += declaration

    def write(
        self, connection: Connection, timestamp: int, data: bytes | memoryview, sent_ns: int = 0
    ) -> None:
        """Write one message with its receive time [ns], and the time at which it was published [ns] where that is known."""
        self._single_rows.append((timestamp, connection.id, len(self._single)))
        self._single += struct.pack(
            "<BQHIQQ",
            MESSAGE,
            MESSAGE_HEAD.itemsize - 9 + len(data),
            connection.id,
            0,
            timestamp,
            sent_ns or timestamp,
        )
        self._single += data
        if len(self._single) > CHUNK_SIZE:
            self.close_chunk()

    def write_arrays(self, parts: Sequence[tuple[int, NDArray[np.int64], NDArray[np.uint8]]]) -> None:
        """Write the messages of several topics in order of receive time.

        Each part is a channel, receive times int64[n] [ns] and equally long messages uint8[n, size].
        """
        self.close_chunk()
        records = [message_records(channel, log_ns, data) for channel, log_ns, data in parts]
        log_ns = np.concatenate([part[1] for part in parts])
        channel = np.repeat([part[0] for part in parts], [len(part[1]) for part in parts])
        size = np.repeat([rows.shape[1] for rows in records], [len(rows) for rows in records])
        order = np.argsort(log_ns, kind="stable")
        end = np.cumsum(size[order])
        place = np.empty_like(end)
        place[order] = end - size[order]
        block = np.empty(end[-1] if len(end) else 0, dtype=np.uint8)
        first = 0
        for rows in records:
            if len(rows):
                item = np.dtype((np.void, rows.shape[1]))
                windows = np.ndarray((len(block) - item.itemsize + 1,), item, block.data, 0, (1,))
                windows[place[first : first + len(rows)]] = rows.view(item)[:, 0]
            first += len(rows)
        start, log_ns, channel = place[order], log_ns[order], channel[order]
        cuts = np.unique(np.append(np.searchsorted(start, np.arange(0, len(block), CHUNK_SIZE)), len(start)))
        for low, high in zip(cuts[:-1], cuts[1:], strict=True):
            rows, begin = slice(low, high), start[low]
            self._write_chunk(
                block[begin : end[high - 1]].tobytes(), log_ns[rows], channel[rows], start[rows] - begin
            )

    def close_chunk(self) -> None:
        """End the chunk of single messages."""
        if self._single_rows:
            log_ns, channel, start = np.array(self._single_rows, dtype=np.int64).T
            self._write_chunk(bytes(self._single), log_ns, channel, start)
            self._single.clear()
            self._single_rows.clear()

    def flush(self) -> None:
        """Pass all data written so far to the operating system."""
        self.close_chunk()
        self._file.flush()

    def _write_chunk(
        self, records: bytes, log_ns: NDArray[np.int64], channel: NDArray[np.int64], start: NDArray[np.int64]
    ) -> None:
        head = len(self._undeclared)
        plain = bytes(self._undeclared) + records
        self._undeclared.clear()
        span = int(log_ns.min()), int(log_ns.max())
        packed = compress(plain) if self._method else plain
        chunk = record(
            CHUNK,
            struct.pack("<QQQI", *span, len(plain), zlib.crc32(plain)),
            text(self._method),
            struct.pack("<Q", len(packed)),
            packed,
        )
        at = self._file.tell()
        self._write(chunk)
        offsets = b""
        for number in np.unique(channel).tolist():
            mine = channel == number
            index = np.column_stack([log_ns[mine], start[mine] + head]).astype("<u8").tobytes()
            offsets += struct.pack("<HQ", number, self._file.tell())
            self._write(record(MESSAGE_INDEX, struct.pack("<HI", number, len(index)), index))
            self._counts[number] += int(mine.sum())
        self._chunk_index.append(
            record(
                CHUNK_INDEX,
                struct.pack("<QQQQI", *span, at, len(chunk), len(offsets)),
                offsets,
                struct.pack("<Q", self._file.tell() - at - len(chunk)),
                text(self._method),
                struct.pack("<QQ", len(packed), len(plain)),
            )
        )
        self._first_ns, self._last_ns = min(self._first_ns, span[0]), max(self._last_ns, span[1])

    def close(self, version: int, metadata: str) -> None:
        """Write pending data, metadata and summary, and close the file."""
        del version
        self.close_chunk()
        self._write(self._undeclared)  # topics without messages
        entry = text("serialized_metadata") + text(metadata)
        at = self._file.tell()
        written = self._write(record(METADATA, text("rosbag2"), struct.pack("<I", len(entry)), entry))
        self._write(record(DATA_END, struct.pack("<I", self._checksum)))
        counts = b"".join(struct.pack("<HQ", *item) for item in sorted(self._counts.items()))
        statistics = struct.pack(
            "<QHIIIIQQI",
            sum(self._counts.values()),
            len(self._schemas),
            len(self._counts),
            0,  # attachments
            1,  # metadata records
            len(self._chunk_index),
            self._first_ns if self._chunk_index else 0,
            self._last_ns,
            len(counts),
        )
        groups = [
            (SCHEMA, b"".join(item for item in self._declared if item[0] == SCHEMA)),
            (CHANNEL, b"".join(item for item in self._declared if item[0] == CHANNEL)),
            (STATISTICS, record(STATISTICS, statistics, counts)),
            (CHUNK_INDEX, b"".join(self._chunk_index)),
            (METADATA_INDEX, record(METADATA_INDEX, struct.pack("<QQ", at, written), text("rosbag2"))),
        ]
        summary, self._checksum = self._file.tell(), 0
        offsets = b""
        for op, group in groups:
            if group:
                offsets += record(SUMMARY_OFFSET, struct.pack("<BQQ", op, self._file.tell(), len(group)))
                self._write(group)
        offset_start = self._file.tell()
        self._write(offsets)
        self._write(struct.pack("<BQQQ", FOOTER, _FOOTER_SIZE, summary, offset_start))
        self._write(struct.pack("<I", self._checksum) + MAGIC)
        self._file.close()

    def abort(self) -> None:
        """Close the file in its current state, without summary."""
        self._file.close()
