"""sensor_msgs/JointState of one joint as CDR bytes: read and written in place, without building a message.

At 1 kHz and five hops per sample, message objects would take more time than everything else together.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from rhythmid.record.messages import Messages

from .sample import Sample

FIELDS = ("position", "velocity", "effort")
CDR = 4  # encapsulation header; CDR aligns relative to its end
LITTLE_ENDIAN = b"\x00\x01"
_stamp = struct.Struct("<iI")
_count = struct.Struct("<I")
_double = struct.Struct("<d")


def stamp_of(data: bytes) -> int:
    """Header stamp [ns] of a serialized message whose first field is a std_msgs/Header."""
    seconds, nanoseconds = _stamp.unpack_from(data, CDR)
    return seconds * 1_000_000_000 + nanoseconds


def pack_stamp(buffer: bytearray, stamp_ns: int) -> None:
    """Give a serialized message another header stamp [ns], in place."""
    _stamp.pack_into(buffer, CDR, *divmod(stamp_ns, 1_000_000_000))


def restamped(data: bytes, stamp_ns: int) -> bytes:
    """The same message with another header stamp [ns]."""
    changed = bytearray(data)
    pack_stamp(changed, stamp_ns)
    return bytes(changed)


def _aligned(offset: int, size: int) -> int:
    return offset + (CDR - offset) % size


def _skip_string(data: bytes, offset: int) -> tuple[bytes, int]:
    offset = _aligned(offset, 4)
    (length,) = _count.unpack_from(data, offset)
    start = offset + 4
    return data[start : start + length - 1], start + length


def layout(data: bytes) -> tuple[list[bytes], list[tuple[int, int]]]:
    """Joint names, and (offset, count) of the position, velocity and effort arrays."""
    _, offset = _skip_string(data, CDR + 8)
    offset = _aligned(offset, 4)
    (joints,) = _count.unpack_from(data, offset)
    offset += 4
    names = []
    for _ in range(joints):
        name, offset = _skip_string(data, offset)
        names.append(name)
    arrays = []
    for _ in range(3):
        offset = _aligned(offset, 4)
        (count,) = _count.unpack_from(data, offset)
        offset += 4
        start = _aligned(offset, 8) if count else offset
        arrays.append((start, count))
        offset = start + 8 * count
    return names, arrays


class JointStateReader:
    """Reads the numbers of one joint from serialized JointState messages."""

    def __init__(self, joint: str) -> None:
        self._joint = joint
        self._name = joint.encode()

    def read(self, data: bytes) -> Sample | None:
        """The joint's sample, or None if the message does not name the joint."""
        if data[:2] != LITTLE_ENDIAN:
            return self._read_slowly(data)
        names, arrays = layout(data)
        if self._name not in names:
            return None
        index = names.index(self._name)
        values = [
            _double.unpack_from(data, start + 8 * index)[0] if index < count else math.nan
            for start, count in arrays
        ]
        return Sample(stamp_of(data), *values)

    @staticmethod
    def names(data: bytes) -> list[str]:
        """The joints that a message names."""
        if data[:2] != LITTLE_ENDIAN:
            return list(deserialize_message(data, JointState).name)
        return [name.decode(errors="replace") for name in layout(data)[0]]

    def _read_slowly(self, data: bytes) -> Sample | None:
        message = deserialize_message(data, JointState)
        if self._joint not in message.name:
            return None
        index = list(message.name).index(self._joint)
        values = [
            float(array[index]) if index < len(array) else math.nan
            for array in (message.position, message.velocity, message.effort)
        ]
        stamp = message.header.stamp
        return Sample(stamp.sec * 1_000_000_000 + stamp.nanosec, *values)


class JointStateWriter:
    """Writes serialized JointState messages of one joint that carry the named fields."""

    def __init__(self, joint: str, *fields: str) -> None:
        # rclpy's serialize_message hands out all the bytes that it reserved, more than the message has, and leaves in its
        # padding what the memory held: strict readers refuse the first, and equal messages differ by the second
        columns: dict[str, Any] = {field: np.zeros(1) for field in fields}
        self._buffer = bytearray(Messages(np.zeros(1, dtype=np.int64), **columns).serialised(joint).tobytes())
        _, arrays = layout(bytes(self._buffer))
        self._offsets = [arrays[FIELDS.index(field)][0] for field in fields]

    def write(self, stamp_ns: int, *values: float) -> bytes:
        """A message with header stamp [ns] and one value per field, in the order the fields were named."""
        pack_stamp(self._buffer, stamp_ns)
        for offset, value in zip(self._offsets, values, strict=True):
            _double.pack_into(self._buffer, offset, value)
        return bytes(self._buffer)
