"""Joint-state messages of one topic as arrays, and their serialised form (CDR, little-endian).

All topics of a run carry sensor_msgs/msg/JointState with one joint: position [m], velocity [m/s], effort [N]. A field
that a topic does not carry is an empty list in the message.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError

FIELDS = ("position", "velocity", "effort")
LAST_STAMP_NS = (2**31 - 1) * 1_000_000_000  # builtin_interfaces/Time counts seconds in an int32


@dataclass(frozen=True, eq=False)
class Messages:
    """Messages of one topic, in the order in which they were sent.

    Attributes
    ----------
    stamp_ns : int64[n]
        Header stamps [ns].
    position, velocity, effort : float64[n] or None
        Values [m, m/s, N] of the one joint; None where the topic does not carry the field.
    receive_ns : int64[n] or None
        Receive time of each message [ns]; None means equal to the stamp.
    """

    stamp_ns: NDArray[np.int64]
    position: NDArray[np.float64] | None = None
    velocity: NDArray[np.float64] | None = None
    effort: NDArray[np.float64] | None = None
    receive_ns: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        for name in (*FIELDS, "receive_ns"):
            column = getattr(self, name)
            if column is not None and np.shape(column) != np.shape(self.stamp_ns):
                raise ValueError(
                    f"{name} has shape {np.shape(column)}, stamps have {np.shape(self.stamp_ns)}"
                )

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @property
    def log_ns(self) -> NDArray[np.int64]:
        """Receive times [ns], int64[n]."""
        return np.asarray(self.stamp_ns if self.receive_ns is None else self.receive_ns, dtype=np.int64)

    def check(self, topic: str) -> None:
        """Raise InputError, naming `topic`, unless every value is finite and every stamp fits the message."""
        for name in FIELDS:
            column = getattr(self, name)
            if column is not None and not np.isfinite(column).all():
                first = int(np.argmin(np.isfinite(column)))
                raise InputError(
                    f"{topic}: {name} of message {first} is {column[first]}: only finite values are written"
                )
        for name in ("stamp_ns", "receive_ns"):
            column = getattr(self, name)
            if (
                column is not None
                and len(column)
                and not 0 <= np.min(column) <= np.max(column) <= LAST_STAMP_NS
            ):
                raise InputError(f"{topic}: {name} lies outside [0, 2^31) s, which a message cannot hold")

    def serialised(self, joint: str = "leg", frame_id: str = "") -> NDArray[np.uint8]:
        """CDR bytes of all messages, uint8[n, size]: every message of a topic has the same layout."""
        present = {name: column for name in FIELDS if (column := getattr(self, name)) is not None}
        layout, template = _joint_state_layout(joint.encode(), frame_id.encode(), tuple(present))
        rows = np.zeros(len(self), dtype=layout)
        rows.view(np.uint8).reshape(-1, len(template))[:] = template
        rows["sec"], rows["nanosec"] = np.divmod(np.asarray(self.stamp_ns, dtype=np.int64), 1_000_000_000)
        for name, column in present.items():
            rows[name] = column
        return rows.view(np.uint8).reshape(-1, len(template))


def string_message(value: str) -> bytes:
    """CDR bytes of a std_msgs/msg/String."""
    data = value.encode() + b"\0"
    return b"\x00\x01\x00\x00" + len(data).to_bytes(4, "little") + data


def _joint_state_layout(
    joint: bytes, frame_id: bytes, present: tuple[str, ...]
) -> tuple[np.dtype, NDArray[np.uint8]]:
    """Positions of the numbers in such a JointState, and the bytes of one whose numbers are all zero."""
    body = bytearray()
    at: dict[str, tuple[str, int]] = {"sec": ("<i4", 4), "nanosec": ("<u4", 8)}

    def align(size: int) -> None:
        body.extend(bytes(-len(body) % size))

    def count(number: int) -> None:
        align(4)
        body.extend(number.to_bytes(4, "little"))

    def text(value: bytes) -> None:
        count(len(value) + 1)
        body.extend(value + b"\0")

    body.extend(bytes(8))  # stamp
    text(frame_id)
    count(1)  # one joint
    text(joint)
    for name in FIELDS:
        count(int(name in present))
        if name in present:
            align(8)
            at[name] = ("<f8", 4 + len(body))
            body.extend(bytes(8))
    template = np.frombuffer(b"\x00\x01\x00\x00" + bytes(body), dtype=np.uint8)  # CDR, little-endian
    names = list(at)
    layout = np.dtype(
        {
            "names": names,
            "formats": [at[name][0] for name in names],
            "offsets": [at[name][1] for name in names],
            "itemsize": len(template),
        }
    )
    return layout, template
