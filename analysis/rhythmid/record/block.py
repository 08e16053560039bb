"""Serialised messages in the form of a bag: one buffer, and the position of each message in it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike, NDArray

from rhythmid.record.compression import ZSTD_MAGIC, decompress


@dataclass(frozen=True)
class Topic:
    """A topic of a bag. `definition` is the message definition that the bag stores, '' if it stores none."""

    name: str
    type: str
    encoding: str = "cdr"
    definition: str = ""
    definition_format: str = ""  # "ros2msg", "ros2idl" or ""
    qos: str = ""  # offered QoS profiles, YAML, as stored in the bag


Wanted = Callable[[Topic], bool]


def gather(buffer: bytes | memoryview, at: NDArray[np.int64], dtype: DTypeLike) -> NDArray:
    """Numbers of `dtype` at the byte offsets `at`, int64[n], aligned or not. Raises ValueError where one is outside
    the buffer."""
    item = np.dtype(dtype)
    if len(at) and not 0 <= at.min() <= at.max() <= len(buffer) - item.itemsize:
        raise ValueError("a number would lie outside of the file")
    windows = np.ndarray((len(buffer) - item.itemsize + 1,), item, buffer, 0, (1,))
    return windows[at]


@dataclass(frozen=True, eq=False)
class Block:
    """Messages of one topic in the order in which they were recorded.

    `start` and `size` give each message's bytes in `buffer`, `log_ns` its receive time [ns], `sent_ns` the time [ns] at
    which it was published; all int64[n]. `sent_ns` is None where that time is not recorded.
    """

    topic: Topic
    buffer: bytes | memoryview
    start: NDArray[np.int64]
    size: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    sent_ns: NDArray[np.int64] | None = None

    def __len__(self) -> int:
        return len(self.start)

    def __iter__(self) -> Iterator[bytes]:
        view = memoryview(self.buffer)
        for start, size in zip(self.start.tolist(), self.size.tolist(), strict=True):
            yield bytes(view[start : start + size])

    def plain(self) -> "Block":
        """The block with every message decompressed, where messages are compressed one by one.

        No CDR message begins like a zstd frame, so the bytes themselves show it. Raises ValueError on damage.
        """
        if not len(self) or bytes(self.buffer[self.start[0] : self.start[0] + 4]) != ZSTD_MAGIC:
            return self
        messages = [decompress(message, "zstd") for message in self]
        size = np.array([len(message) for message in messages], dtype=np.int64)
        return Block(self.topic, b"".join(messages), np.cumsum(size) - size, size, self.log_ns, self.sent_ns)


def by_topic(
    topics: dict[int, Topic],
    number: NDArray[np.int64],
    buffer: bytes | memoryview,
    start: NDArray[np.int64],
    size: NDArray[np.int64],
    log_ns: NDArray[np.int64],
    sent_ns: NDArray[np.int64] | None = None,
) -> Iterator[Block]:
    """Split messages into one block per topic. `number` is the topic of each message; messages of other topics are
    left out."""
    for key, topic in topics.items():
        mine = np.flatnonzero(number == key)
        if len(mine):
            sent = None if sent_ns is None else sent_ns[mine]
            yield Block(topic, buffer, start[mine], size[mine], log_ns[mine], sent).plain()
