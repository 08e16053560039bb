"""MCAP files read front to back (format: https://mcap.dev/spec).

The index at the end of a file is not needed. So a file whose recorder was killed is read like any other, up to the
last complete message. A file with a damaged beginning is read from its first complete chunk on. Records are located
by their lengths; numbers are then read by array.
"""

import mmap
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from rhythmid.errors import InputError
from rhythmid.record.block import Block, Topic, Wanted, by_topic, gather
from rhythmid.record.compression import decompress
from rhythmid.record.mcap_damage import (
    FOOTER_SIZE,
    MESSAGE_HEAD_SIZE,
    begins_chunk,
    counted,
    find_chunk,
    find_messages,
    is_chunk,
    is_header,
    is_record,
    messages_in_chunk,
    summary_start,
    wrong_checksums,
)
from rhythmid.record.mcap_writer import CHANNEL, CHUNK, FOOTER, MAGIC, MESSAGE, SCHEMA

_head = struct.Struct("<BQ")
_MESSAGE_BATCH = 100_000  # messages outside of chunks are returned in blocks of at most this size


class McapReader:
    """One MCAP file. After `blocks` is exhausted, `topics` lists all topics, `truncated` says whether the file is
    incomplete, and `damage` lists what was skipped."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, Topic] = {}
        self.truncated = False
        self.damage: list[str] = []
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._channels: dict[int, Topic] = {}
        self._undeclared: Counter[int] = Counter()  # messages by channel of unknown topic
        try:
            with path.open("rb") as file:
                size = file.seek(0, os.SEEK_END)
                self._data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if size else b"")
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        self._begin = len(MAGIC)
        if bytes(self._data[: len(MAGIC)]) != MAGIC or not is_header(self._data):
            self._begin = self._behind_damaged_beginning()

    def _behind_damaged_beginning(self) -> int:
        """Position of the first chunk in a file whose first bytes are damaged."""
        magic = bytes(self._data[: len(MAGIC)]) == MAGIC
        first = find_chunk(self._data, 0)
        first = find_messages(self._data, 0) if first is None else first
        if magic and first in (None, len(MAGIC)):  # ends there, or has no header
            return len(MAGIC)
        if first is None:
            raise InputError(
                f"{self.path}: is not an MCAP file (it does not start with the MCAP magic bytes)"
            )
        self.damage.append(f"its first {first} bytes are damaged and were skipped")
        self._declare_from_summary()
        return first

    def blocks(self, wanted: Wanted = lambda topic: True) -> Iterator[Block]:
        """Messages of the wanted topics, block by block in file order."""
        at, end = self._begin, len(self._data)
        while at < end:
            loose, last, at = self._scan(self._data, at, end)
            yield from self._split(self._data, loose, wanted)
            whole = at + 9 <= end and (size := _head.unpack_from(self._data, at)[1]) <= end - at - 9
            if whole and self._data[at] == FOOTER:
                self._tell_undeclared()
                return
            if whole and self._data[at] == MESSAGE:  # the scan returns limited batches
                continue
            if is_chunk(self._data, at, end):
                yield from self._chunk(at + 9, at + 9 + size, wanted, whole=True)
                at += 9 + size
                continue
            following = find_chunk(self._data, last + 1)  # the length of the last record may be wrong
            if following is None and not begins_chunk(self._data, at, end):
                following = find_messages(self._data, last + 1)
            if following is None:
                break
            self._declare_from_summary()  # the skipped part may have declared topics
            self.damage.append(f"bytes {at} to {following} are damaged and were skipped")
            at = following
        self.truncated = True
        if at + 9 <= end and self._data[at] == CHUNK:
            yield from self._chunk(at + 9, end, wanted, whole=False)
        self._tell_undeclared()

    def _tell_undeclared(self) -> None:
        self.damage += [
            f"{count} messages of channel {number} are lost: the part of the file that names its topic is damaged"
            for number, count in sorted(self._undeclared.items())
        ]

    def wrong_checksums(self) -> list[str]:
        """Checksum errors of a finished file, one phrase each."""
        return [] if self.truncated else wrong_checksums(self._data)

    def counted(self) -> dict[str, int]:
        """Number of messages by topic according to the end of the file; empty if it does not state them."""
        names = {number: topic.name for number, topic in self._channels.items()}
        found: dict[str, int] = {}
        for number, count in counted(self._data).items():
            if number in names:
                found[names[number]] = found.get(names[number], 0) + count
        return found

    def _scan(self, data: bytes | memoryview, at: int, end: int) -> tuple[list[int], int, int]:
        """Offsets of message records from `at` up to a chunk, the footer, an incomplete record, or the end.

        Also returns the offset of the last record that was passed, and of the end of the scan.
        """
        found: list[int] = []
        last = at
        unpack, add = _head.unpack_from, found.append
        while at + 9 <= end:
            op, size = unpack(data, at)
            following = at + 9 + size
            if following > end or (len(found) >= _MESSAGE_BATCH and data is self._data):
                break
            if op == MESSAGE:
                if size >= MESSAGE_HEAD_SIZE:  # a shorter record is no message
                    add(at)
            elif op == SCHEMA:
                self._declare_schema(bytes(data[at + 9 : following]))
            elif op == CHANNEL:
                self._declare_channel(bytes(data[at + 9 : following]))
            elif op in (FOOTER, CHUNK) or not is_record(data, at, end):
                break
            last, at = at, following
        return found, last, at

    def _split(self, data: bytes | memoryview, found: list[int], wanted: Wanted) -> Iterator[Block]:
        if not found:
            return
        at = np.array(found, dtype=np.int64)
        topics = {number: topic for number, topic in self._channels.items() if wanted(topic)}
        size = gather(data, at + 1, "<i8") - MESSAGE_HEAD_SIZE
        log_ns, sent_ns = gather(data, at + 15, "<i8"), gather(data, at + 23, "<i8")
        channel = gather(data, at + 9, "<u2")
        unknown, counts = np.unique(channel[~np.isin(channel, list(self._channels))], return_counts=True)
        self._undeclared.update(dict(zip(unknown.tolist(), counts.tolist(), strict=True)))
        yield from by_topic(topics, channel, data, at + 31, size, log_ns, sent_ns)

    def _chunk(self, at: int, end: int, wanted: Wanted, whole: bool) -> Iterator[Block]:
        """Messages of the chunk whose content starts at `at`; of an incomplete chunk, those that are present."""
        try:
            size, checksum = struct.unpack_from("<QI", self._data, at + 16)
            method, content = _text(self._data, at + 28)
            content += 8  # length of the following data
            plain = (
                self._data[content:end]
                if method == ""
                else decompress(bytes(self._data[content:end]), method)
            )
            if whole and len(plain) != size:
                raise ValueError(f"{len(plain)} bytes instead of {size}")
            if whole and checksum and zlib.crc32(plain) != checksum:
                raise ValueError("its checksum is wrong")
        except (ValueError, struct.error) as error:
            self._declare_from_summary()  # the skipped chunk may have declared it
            held = ", ".join(
                f"{count} of {self._channels[number].name}" if number in self._channels else f"{count} others"
                for number, count in (messages_in_chunk(self._data, end) if whole else {}).items()
            )
            held = f"; lost messages: {held}" if held else ""
            self.damage.append(f"chunk at byte {at - 9} is damaged and was skipped: {error}{held}")
            return
        found, _, stop = self._scan(plain, 0, len(plain))
        if whole and stop < len(plain):
            self.damage.append(
                f"chunk at byte {at - 9} is damaged: its last {len(plain) - stop} bytes were skipped"
            )
        yield from self._split(plain, found, wanted)

    def _declare_from_summary(self) -> None:
        """Declare the topics that the summary at the end of the file repeats, if there is one."""
        if at := summary_start(self._data):
            with suppress(struct.error):  # the summary may be damaged, too
                self._scan(self._data, at, len(self._data) - len(MAGIC) - FOOTER_SIZE)

    def _declare_schema(self, body: bytes) -> None:
        (number,) = struct.unpack_from("<H", body)
        name, at = _text(body, 2)
        encoding, at = _text(body, at)
        self._schemas[number] = name, encoding, _text(body, at)[0]

    def _declare_channel(self, body: bytes) -> None:
        number, schema = struct.unpack_from("<HH", body)
        if number in self._channels:
            return
        name, at = _text(body, 4)
        encoding, at = _text(body, at)
        metadata, at = {}, at + 4
        while at < len(body):
            key, at = _text(body, at)
            metadata[key], at = _text(body, at)
        msgtype, form, definition = self._schemas.get(schema, ("", "", ""))
        qos = metadata.get("offered_qos_profiles", "")
        self._channels[number] = Topic(name, msgtype, encoding, definition, form, qos)
        self.topics[name] = self._channels[number]


def _text(data: bytes | memoryview, at: int) -> tuple[str, int]:
    """A length-prefixed string at `at`, and the position of its end."""
    (size,) = struct.unpack_from("<I", data, at)
    return bytes(data[at + 4 : at + 4 + size]).decode("utf-8", "replace"), at + 4 + size
