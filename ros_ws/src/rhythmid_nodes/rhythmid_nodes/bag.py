"""A rosbag2 bag that is written during a run: one thread owns the file, and a crash loses at most the last second."""

from __future__ import annotations

import os
import sqlite3
import threading
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2.errors import WriterError
from rosbags.typesys import Stores, get_typestore

from rhythmid.errors import InputError
from rhythmid.record.bag_writer import BagWriter
from rhythmid.record.message_types import STANDARD_DISTRO

from .clock import Worker
from .definitions import learn

_DRAIN_PERIOD = 0.1


def running_distro() -> str:
    """The running ROS distribution; its Python wheels do not set the variable that an installation sets."""
    return os.environ.get("ROS_DISTRO") or STANDARD_DISTRO


@dataclass(frozen=True)
class Storage:
    """Where and how a live bag is written.

    Attributes
    ----------
    path
        Folder of the bag; must not exist. Until the bag is closed it has no metadata.yaml; after a crash `rhythmid recover`
        brings back what had been written.
    kind
        `mcap` or `sqlite3`.
    flush_period
        Seconds after which written data survive the end of the process.
    queue_size
        Largest number of waiting messages; further ones are dropped.
    max_size, max_duration
        Bytes of messages and seconds after which the next file is begun; 0: never.
    by_message_time
        Whether the flush period counts in the messages' time, so that equal messages give equal files.
    """

    path: Path
    kind: Literal["mcap", "sqlite3"] = "mcap"
    flush_period: float = 1.0
    queue_size: int = 200_000
    max_size: int = 0
    max_duration: float = 0.0
    by_message_time: bool = False


class LiveBag(Worker):
    """Takes messages from any thread and writes them to a new bag; `dropped` counts the messages that did not fit into the queue."""

    def __init__(self, storage: Storage) -> None:
        super().__init__("bag", self._write_all)
        self.dropped = 0
        self._storage = storage
        self._flush_ns = round(storage.flush_period * 1e9)
        self._max_ns = round(storage.max_duration * 1e9) or 2**63
        self._max_size = storage.max_size or 2**63
        self._flushed_ns = 0
        self._queue: deque[tuple[str, int, bytes, int]] = deque()
        self._topics: deque[tuple[str, str, Sequence[TopicEndpointInfo]]] = deque()
        self._connections: dict[str, Connection] = {}
        self._typestore = get_typestore(Stores.ROS2_JAZZY)
        self._opened = threading.Event()
        self._split_asked = threading.Event()

    def open(self) -> None:
        """Create the bag. Raises InputError if its place exists or cannot be written."""
        self.start()
        self._opened.wait()
        if self.failure is not None:
            raise self.failure

    def __len__(self) -> int:
        return len(self._queue)

    def add_topic(self, topic: str, type_name: str, publishers: Sequence[TopicEndpointInfo]) -> None:
        """Announce a topic before its first message. Raises InputError if its type's definition is not known."""
        learn(self._typestore, type_name)
        self._topics.append((topic, type_name, publishers))

    def put(self, topic: str, receive_ns: int, data: bytes, sent_ns: int = 0) -> None:
        """Queue a message of an announced topic, with when it was received and sent [ns since the epoch; 0 if unknown]."""
        if len(self._queue) >= self._storage.queue_size:
            self.dropped += 1
        else:
            self._queue.append((topic, receive_ns, data, sent_ns))

    def split(self) -> None:
        """Begin the next file as soon as the queued messages have been written."""
        self._split_asked.set()

    def _write_all(self) -> None:
        path = self._storage.path
        try:
            writer = BagWriter(path, self._storage.kind, numbered=True, ros_distro=running_distro())
            writer.open()
        except (WriterError, OSError, sqlite3.Error) as error:
            self.failure = InputError(f"{path}: {error}")
            return
        finally:
            self._opened.set()
        try:
            while not self.stopping.wait(_DRAIN_PERIOD):
                self._drain(writer)
            self._drain(writer)
            writer.close()
        except (OSError, sqlite3.Error) as error:  # the disk is full or gone
            with suppress(OSError, sqlite3.Error):
                writer.abort()
            self.failure = InputError(
                f"{path}: {error}; the recording broke off, and rhythmid recover brings back what was written"
            )
        except BaseException:
            writer.close()  # everything before the failure is a complete bag
            raise

    def _drain(self, writer: BagWriter) -> None:
        for _ in range(len(self._queue)):
            topic, receive_ns, data, sent_ns = self._queue.popleft()
            if topic not in self._connections:
                self._connect(writer)
            file = writer.file
            if file.size and (file.size > self._max_size or receive_ns - file.first_ns >= self._max_ns):
                writer.split()
            if self._storage.by_message_time:
                self._flush_when_due(writer, receive_ns)
            writer.write(self._connections[topic], receive_ns, data, sent_ns)
        self._connect(writer)
        if self._split_asked.is_set():
            self._split_asked.clear()
            writer.split()
        if not self._storage.by_message_time:
            self._flush_when_due(writer, time.monotonic_ns())

    def _flush_when_due(self, writer: BagWriter, now_ns: int) -> None:
        if now_ns - self._flushed_ns >= self._flush_ns:
            writer.flush()
            self._flushed_ns = now_ns

    def _connect(self, writer: BagWriter) -> None:
        while self._topics:
            topic, type_name, publishers = self._topics.popleft()
            profiles = {
                repr(qos): qos for qos in (_offered(publisher.qos_profile) for publisher in publishers)
            }
            self._connections[topic] = writer.add_connection(
                topic, type_name, typestore=self._typestore,
                offered_qos_profiles=[profiles[key] for key in sorted(profiles)],  # each once
            )  # fmt: skip


def _offered(profile: Any) -> Qos:
    """A publisher's quality of service as rosbag2 stores it."""
    durations = [
        QosTime(*divmod(duration.nanoseconds, 1_000_000_000))
        for duration in (profile.deadline, profile.lifespan, profile.liveliness_lease_duration)
    ]
    return Qos(
        QosHistory(int(profile.history)),
        profile.depth,
        QosReliability(int(profile.reliability)),
        QosDurability(int(profile.durability)),
        durations[0],
        durations[1],
        QosLiveliness(int(profile.liveliness)),
        durations[2],
        bool(profile.avoid_ros_namespace_conventions),
    )
