"""sensor_msgs/JointState of several joints as CDR bytes, read and written in place as those of one joint are."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.joint_messages import serialised

from .joint_state import CDR, FIELDS, LITTLE_ENDIAN, JointStateReader, layout, pack_stamp, stamp_of
from .sample import Sample


class JointStatesReader:
    """Reads the numbers of joints, in this order, from serialized JointState messages."""

    def __init__(self, joints: Sequence[str]) -> None:
        self._joints = [joint.encode() for joint in joints]
        self._slow = [JointStateReader(joint) for joint in joints]
        self._head = b""  # of the newest message but its stamp: equal ones have equal places
        self._places: list[list[int | None]] = []

    def read(self, data: bytes) -> list[Sample] | None:
        """A sample of each joint, or None where the message lacks one."""
        if data[:2] != LITTLE_ENDIAN:
            found = [reader.read(data) for reader in self._slow]
            return None if None in found else [sample for sample in found if sample is not None]
        if not self._head or not data.startswith(self._head, CDR + 8):
            if not self._learn(data):
                return None
        stamp = stamp_of(data)
        return [
            Sample(
                stamp,
                *(
                    math.nan if place is None else struct.unpack_from("<d", data, place)[0]
                    for place in places
                ),
            )
            for places in self._places
        ]

    @staticmethod
    def names(data: bytes) -> list[str]:
        """The joints that a message names."""
        return JointStateReader.names(data)

    def _learn(self, data: bytes) -> bool:
        names, arrays = layout(data)
        if any(joint not in names for joint in self._joints):
            return False
        self._places = []
        for joint in self._joints:
            index = names.index(joint)
            self._places.append([start + 8 * index if index < count else None for start, count in arrays])
        first = min((start for start, count in arrays if count), default=len(data))
        self._head = data[CDR + 8 : first]
        return True


class JointStatesWriter:
    """Writes serialized JointState messages of joints that carry the named fields."""

    def __init__(self, joints: Sequence[str], *fields: str) -> None:
        columns = {field: np.zeros((1, len(joints))) for field in fields}
        self._buffer = bytearray(serialised(np.zeros(1, dtype=np.int64), joints, columns).tobytes())
        _, arrays = layout(bytes(self._buffer))
        self._offsets = [arrays[FIELDS.index(field)][0] for field in fields]
        self._row = struct.Struct(f"<{len(joints)}d")

    def write(self, stamp_ns: int, *rows: NDArray[np.float64]) -> bytes:
        """A message with header stamp [ns] and a row (joints,) for each field, in the order the fields were named."""
        pack_stamp(self._buffer, stamp_ns)
        for offset, row in zip(self._offsets, rows, strict=True):
            self._row.pack_into(self._buffer, offset, *row)
        return bytes(self._buffer)
