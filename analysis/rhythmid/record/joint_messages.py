"""Joint states of several joints in one message: their serialised form (CDR, little-endian)."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.bag_writer import Storage, add_topic, new_bag
from rhythmid.record.messages import FIELDS

Columns = Mapping[str, NDArray[np.float64]]  # field -> (n, joints)


def serialised(stamp_ns: NDArray[np.int64], joints: Sequence[str], columns: Columns) -> NDArray[np.uint8]:
    """CDR bytes of sensor_msgs/msg/JointState messages, uint8[n, size]: one per stamp, with all joints.

    `columns` are float64[n, joints] by field: position [m or rad], velocity, effort.
    """
    body = bytearray(8)  # the stamp
    places: dict[str, int] = {}

    def count(number: int) -> None:
        body.extend(bytes(-len(body) % 4))
        body.extend(number.to_bytes(4, "little"))

    def text(value: bytes) -> None:
        count(len(value) + 1)
        body.extend(value + b"\0")

    text(b"")  # frame
    count(len(joints))
    for joint in joints:
        text(joint.encode())
    for name in FIELDS:
        count(len(joints) if name in columns else 0)
        if name in columns:
            body.extend(bytes(-len(body) % 8))
            places[name] = 4 + len(body)
            body.extend(bytes(8 * len(joints)))
    rows = np.tile(np.frombuffer(b"\x00\x01\x00\x00" + bytes(body), dtype=np.uint8), (len(stamp_ns), 1))
    seconds = np.column_stack(np.divmod(stamp_ns, 1_000_000_000)).astype("<u4")
    rows[:, 4:12] = np.ascontiguousarray(seconds).view(np.uint8)
    for name, place in places.items():
        values = np.ascontiguousarray(columns[name], dtype="<f8")
        rows[:, place : place + 8 * len(joints)] = values.view(np.uint8)
    return rows


def write_joint_bag(
    path: str | Path,
    topics: Mapping[str, tuple[NDArray[np.int64], Sequence[str], Columns]],
    storage: Storage = "mcap",
) -> Path:
    """Write joint states of several joints as a bag: by topic the stamps [ns], the joints and their columns.

    Raises InputError when the path exists or cannot be written.
    """
    with new_bag(path, storage) as writer:
        parts = [
            (
                add_topic(writer, topic, "sensor_msgs/msg/JointState"),
                stamps,
                serialised(stamps, joints, columns),
            )
            for topic, (stamps, joints, columns) in topics.items()
        ]
        writer.write_arrays(parts)
    return Path(path)
