"""Messages of running topics as samples, read like those of a bag according to signals.yaml."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.block import Block, Topic
from rhythmid.record.columns import read_columns, without_times
from rhythmid.record.signals import Signals, Source
from rhythmid.twin.twin import Role

Array = NDArray[np.float64]
ROLES: tuple[Role, ...] = ("input", "output", "forcing", "released")


class Inbox:
    """Takes serialised messages from any thread; `drain` converts them to samples.

    Times are seconds since the first message. `released` is the source of the commands as released by the last relay. Raises
    InputError where the signals do not name topics, or where a forcing is given by a formula.
    """

    def __init__(self, signals: Signals, released: Source | None = None) -> None:
        if signals.from_tables:
            raise InputError(f"{signals.path}: names columns of tables; a running machine has topics")
        if signals.forcing_law is not None:
            raise InputError(
                f"{signals.path}: the forcing is given by formula, whose clock is that of a record; name the topic that carries it"
            )
        self._signals = signals
        self.channels: dict[Role, Source] = {
            role: signals.channels[role] for role in ROLES if role in signals.channels
        }
        if released is not None:
            self.channels["released"] = released
        self.topics = tuple(dict.fromkeys(source.topic for source in self.channels.values()))
        self._types: dict[str, Topic] = {}
        self._waiting: dict[str, deque[tuple[bytes, int, int]]] = {topic: deque() for topic in self.topics}
        self.origin_ns: int | None = None

    @property
    def forced(self) -> bool:
        """Whether the signals contain the forcing."""
        return "forcing" in self.channels

    def learn_type(self, topic: str, type_name: str, definition: str = "") -> None:
        """Set the message type of a topic, with its definition where it is no standard type."""
        self._types[topic] = Topic(topic, type_name, "cdr", definition, "ros2msg" if definition else "")

    def put(self, topic: str, data: bytes, received_ns: int, sent_ns: int) -> None:
        """Store a message with the times [ns] at which it was received and sent."""
        self._waiting[topic].append((data, received_ns, sent_ns))

    def drain(self) -> dict[Role, tuple[Array, Array]]:
        """Samples of all messages received since the last call: times [s] and values of each role.

        Raises InputError where messages lack the field, or a stamp where one is needed.
        """
        blocks = [self._block(topic) for topic in self.topics]
        wanted = {
            topic: [
                source.field
                for source in self.channels.values()
                if source.topic == topic and source.field is not None
            ]
            for topic in self.topics
        }
        columns = read_columns([block for block in blocks if block is not None], wanted)
        stamped: dict[Role, tuple[NDArray[np.int64], Array]] = {}
        for role, source in self.channels.items():
            if source.topic not in columns or source.field is None:
                continue
            found = columns[source.topic]
            clock = source.clock(self._signals.time).kind
            times = found.times(clock)
            if times is None:
                raise InputError(f"{source.place}{without_times(found, clock)}")
            kept = ~found.missing[source.field]
            stamped[role] = times[kept], found.values[source.field][kept] * source.scale + source.one_offset
        first = [int(times[0]) for times, _ in stamped.values() if len(times)]
        if self.origin_ns is None and first:
            self.origin_ns = min(first)
        origin = self.origin_ns or 0
        samples: dict[Role, tuple[Array, Array]] = {}
        for role, (times, values) in stamped.items():
            samples[role] = np.asarray((times - origin) * 1e-9, dtype=np.float64), values
        return samples

    def _block(self, topic: str) -> Block | None:
        waiting = self._waiting[topic]
        taken = [waiting.popleft() for _ in range(len(waiting))]
        if not taken:
            return None
        size = np.array([len(data) for data, _, _ in taken], dtype=np.int64)
        received, sent = np.array([times for _, *times in taken], dtype=np.int64).T
        buffer = b"".join(data for data, _, _ in taken)
        return Block(self._types[topic], buffer, np.cumsum(size) - size, size, received, sent)
