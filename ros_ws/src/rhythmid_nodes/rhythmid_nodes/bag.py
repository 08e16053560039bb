"""A rosbag2 bag written while messages come in: one thread owns the file, and a crash costs at most the last second."""

from __future__ import annotations

import sqlite3
import threading
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
from rhythmid.record.bag_writer import STORAGES, BagWriter

from .clock import Worker
from .definitions import learn

_DRAIN_PERIOD = 0.1


class LiveBag(Worker):
    """Takes messages from any thread and writes them to a new bag.

    Parameters
    ----------
    path
        Folder of the bag; must not exist. Until the bag is closed it has no metadata.yaml; after a crash
        `rhythmid.record.recover` brings back what had been written.
    storage
        `mcap` or `sqlite3`.
    flush_period
        Seconds after which what was written survives the end of the process.
    queue_size
        Messages waiting at most; more are dropped and counted in `dropped`.
    """

    def __init__(self, path: Path, storage: str, flush_period: float, queue_size: int) -> None:
        super().__init__("bag", self._write_all)
        self.dropped = 0
        self._path, self._storage = path, storage
        self._flush_every = max(1, round(flush_period / _DRAIN_PERIOD))
        self._queue_size = queue_size
        self._queue: deque[tuple[str, int, bytes]] = deque()
        self._topics: deque[tuple[str, str, Sequence[TopicEndpointInfo]]] = deque()
        self._connections: dict[str, Connection] = {}
        self._typestore = get_typestore(Stores.ROS2_JAZZY)
        self._opened = threading.Event()

    def open(self) -> None:
        """Create the bag. Raises InputError if its place is taken or cannot be written."""
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

    def put(self, topic: str, receive_ns: int, data: bytes) -> None:
        """Queue a message [ns since the epoch] of an announced topic."""
        if len(self._queue) >= self._queue_size:
            self.dropped += 1
        else:
            self._queue.append((topic, receive_ns, data))

    def _write_all(self) -> None:
        try:
            writer = BagWriter(self._path, version=9, storage_plugin=STORAGES[self._storage])
            writer.open()
        except (WriterError, OSError, sqlite3.Error) as error:
            self.failure = InputError(f"{self._path}: {error}")
            return
        finally:
            self._opened.set()
        rounds = 0
        try:
            while not self.stopping.wait(_DRAIN_PERIOD):
                self._drain(writer)
                rounds += 1
                if rounds % self._flush_every == 0:
                    writer.flush()
            self._drain(writer)
            writer.close()
        except (
            OSError,
            sqlite3.Error,
        ) as error:  # the disk is full or gone; what was flushed can be recovered
            self.failure = InputError(f"{self._path}: {error}; the bag is not complete")

    def _drain(self, writer: BagWriter) -> None:
        while self._queue:
            topic, receive_ns, data = self._queue.popleft()
            if topic not in self._connections:
                self._connect(writer)
            writer.write(self._connections[topic], receive_ns, data)
        self._connect(writer)

    def _connect(self, writer: BagWriter) -> None:
        while self._topics:
            topic, type_name, publishers = self._topics.popleft()
            self._connections[topic] = writer.add_connection(
                topic, type_name, typestore=self._typestore,
                offered_qos_profiles=[_offered(publisher.qos_profile) for publisher in publishers],
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
