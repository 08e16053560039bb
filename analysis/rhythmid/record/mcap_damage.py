"""Damage of MCAP files: finds chunks after a break, compares checksums, counts lost messages."""

import struct
import zlib
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from rhythmid.record.mcap_writer import (
    CHUNK,
    DATA_END,
    FOOTER,
    HEADER,
    MAGIC,
    MESSAGE,
    MESSAGE_INDEX,
    STATISTICS,
)

FOOTER_SIZE = 9 + 8 + 8 + 4
_DATA_END_SIZE = 9 + 4
_PRIVATE = 0x80  # opcodes from here on are reserved for applications
_METHODS = (b"", b"zstd", b"lz4")
_WINDOW = 2**24  # bytes searched at a time,
_SEARCHED = 2**28  # and in all: no chunk is that long
# consecutive records, each starting where the one before ends: other bytes do not look like that
_CHAINED = 8
MESSAGE_HEAD_SIZE = 2 + 4 + 8 + 8  # bytes of channel, sequence number and two times before the message's data

_head = struct.Struct("<BQ")


def is_record(data: bytes | memoryview, at: int, end: int) -> bool:
    """Whether a known record may be at `at`."""
    if at + 9 > end:
        return False
    op, size = _head.unpack_from(data, at)
    if not 0 < op <= DATA_END and op < _PRIVATE:
        return False
    if op == MESSAGE_INDEX and at + 15 <= end:
        return struct.unpack_from("<I", data, at + 11)[0] == size - 6
    return True


def begins_chunk(data: bytes | memoryview, at: int, end: int) -> bool:
    """Whether a chunk begins at `at`, wherever it ends: the lengths within it must be consistent."""
    if at + 9 + 40 > end or data[at] != CHUNK:
        return False
    size = _head.unpack_from(data, at)[1]
    (length,) = struct.unpack_from("<I", data, at + 37)
    if at + 49 + length > end or length > 4 or bytes(data[at + 41 : at + 41 + length]) not in _METHODS:
        return False
    return struct.unpack_from("<Q", data, at + 41 + length)[0] == size - 40 - length


def is_chunk(data: bytes | memoryview, at: int, end: int) -> bool:
    """Whether a complete chunk is at `at`."""
    return begins_chunk(data, at, end) and _head.unpack_from(data, at)[1] <= end - at - 9


def is_header(data: bytes | memoryview) -> bool:
    """Whether the header record after the magic bytes is complete: the lengths within it must be consistent."""
    at = len(MAGIC)
    if at + 17 > len(data) or data[at] != HEADER:
        return False
    size, profile = struct.unpack_from("<QI", data, at + 1)
    if size < 8 + profile or at + 9 + size > len(data):
        return False
    return struct.unpack_from("<I", data, at + 13 + profile)[0] == size - 8 - profile


def find_chunk(data: memoryview, at: int) -> int | None:
    """Position of the next complete chunk from `at` on; None if there is none within reach."""
    return _find(data, at, CHUNK, is_chunk)


def find_messages(data: memoryview, at: int) -> int | None:
    """Position from `at` on where consecutive records start again, with a message first; None if there are none
    within reach."""
    return _find(data, at, MESSAGE, _are_messages)


def _find(data: memoryview, at: int, op: int, stands: Callable[[memoryview, int, int], bool]) -> int | None:
    end = len(data)
    for begin in range(at, min(end, at + _SEARCHED), _WINDOW):
        window = np.frombuffer(data[begin : min(end, begin + _WINDOW + 9)], dtype=np.uint8)
        if len(window) < 9:
            return None
        high = window[6:-2] | window[7:-1] | window[8:]  # high bytes of a length, zero below a terabyte
        for place in np.flatnonzero((window[:-8] == op) & (high == 0)).tolist():
            if stands(data, begin + place, end):
                return begin + place
    return None


def _are_messages(data: memoryview, at: int, end: int) -> bool:
    """Whether consecutive records start at `at`, with a message first."""
    if at + 9 > end or _head.unpack_from(data, at)[1] < MESSAGE_HEAD_SIZE:
        return False
    for _ in range(_CHAINED):
        if not is_record(data, at, end):
            return False
        op, size = _head.unpack_from(data, at)
        if op == DATA_END:
            return True
        at += 9 + size
    return at <= end


def messages_in_chunk(data: bytes | memoryview, at: int) -> dict[int, int]:
    """Number of messages by channel in the chunk that ends at `at`, from the index after it; empty where there is
    none."""
    found: dict[int, int] = {}
    while at + 15 <= len(data) and data[at] == MESSAGE_INDEX and is_record(data, at, len(data)):
        size = _head.unpack_from(data, at)[1]
        channel, length = struct.unpack_from("<HI", data, at + 9)
        found[channel] = found.get(channel, 0) + length // 16
        at += 9 + size
    return found


def summary_start(data: bytes | memoryview) -> int:
    """Position of the summary; 0 if the file has none or its end is damaged."""
    footer = len(data) - len(MAGIC) - FOOTER_SIZE
    if footer < 0 or bytes(data[-len(MAGIC) :]) != MAGIC or data[footer] != FOOTER:
        return 0
    at = struct.unpack_from("<Q", data, footer + 9)[0]
    return at if at <= footer else 0


def counted(data: bytes | memoryview) -> dict[int, int]:
    """Number of messages by channel according to the summary; empty if it does not state them."""
    at, end = summary_start(data), len(data) - len(MAGIC) - FOOTER_SIZE
    with suppress(struct.error):
        while at and is_record(data, at, end):
            op, size = _head.unpack_from(data, at)
            if op == STATISTICS:
                length = struct.unpack_from("<I", data, at + 9 + 42)[0]
                body = bytes(data[at + 9 + 46 : at + 9 + 46 + length])
                return dict(struct.iter_unpack("<HQ", body))
            at += 9 + size
    return {}


def wrong_checksums(data: bytes | memoryview) -> list[str]:
    """Checksum errors of a finished file, one phrase each; a checksum of 0 is not compared."""
    if bytes(data[-len(MAGIC) :]) != MAGIC:
        return ["its end is damaged or missing"]
    summary, footer = summary_start(data), len(data) - len(MAGIC) - FOOTER_SIZE
    if not summary:
        return []
    found = []
    stated = struct.unpack_from("<I", data, footer + FOOTER_SIZE - 4)[0]
    if stated and zlib.crc32(data[summary : footer + FOOTER_SIZE - 4]) != stated:
        found.append("its summary is not what was written: its checksum is wrong")
    begin = summary - _DATA_END_SIZE
    if begin >= 0 and data[begin] == DATA_END:
        stated = struct.unpack_from("<I", data, begin + 9)[0]
        if stated and zlib.crc32(data[:begin]) != stated:
            found.append("its data are not what was written: their checksum is wrong")
    elif begin >= 0:
        found.append("the end of its data is damaged")
    return found
