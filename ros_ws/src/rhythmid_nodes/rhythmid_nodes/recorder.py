"""recorder: writes topics of any type to a bag; says what it lost, and leaves a valid bag whenever it can.

Services `~/pause` and `~/resume` (std_srvs/Trigger).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rclpy.topic_endpoint_info import TopicEndpointInfo
from std_srvs.srv import Trigger

from rhythmid.errors import InputError

from .bag import LiveBag
from .clock import Clock
from .joint_state import stamp_of
from .lockstep import Acknowledger
from .node import COUNT, RATE, TIME_MODE, WINDOW, GraphNode, run
from .parameters import Parameter
from .qos import AdaptiveSubscription, message_type

_STREAM = "sensor_msgs/msg/JointState"
PARAMETERS = (
    RATE,
    TIME_MODE,
    WINDOW,
    COUNT,
    Parameter("path", "", "folder of the bag; must not exist"),
    Parameter("storage", "mcap", "file format", choices=("mcap", "sqlite3")),
    Parameter("topics", ["excitation", "joint_states", "forcing", "run"], "what to record"),
    Parameter("flush_period", 1.0, "time after which what was received survives a crash", "s", (0.1, 60.0)),
    Parameter("queue_size", 200_000, "messages waiting for the disk at most; more are dropped", "", (1, 10**7)),
)  # fmt: skip


class Track:
    """One recorded topic: what came in, checked by the stamps of the headers."""

    def __init__(self, period_ns: int) -> None:
        self.received = 0
        self.type_name = ""
        self.has_header = False
        self._period_ns = period_ns
        self._stamped = self._duplicates = self._backwards = self._longest_ns = 0
        self._first_ns = self._previous_ns = self._last_ns = 0
        self._on_grid = True

    @property
    def is_stream(self) -> bool:
        """Whether it carries one message for every sample of the grid."""
        return self.type_name == _STREAM

    def add(self, stamp_ns: int) -> None:
        """Take note of the header stamp [ns] of the next message."""
        if self._stamped == 0:
            self._first_ns = self._previous_ns = self._last_ns = stamp_ns
        else:
            step = stamp_ns - self._previous_ns
            self._duplicates += step == 0
            self._backwards += step < 0
            self._on_grid = self._on_grid and step % self._period_ns == 0
            self._longest_ns = max(self._longest_ns, step)
            self._last_ns = max(self._last_ns, stamp_ns)
            self._previous_ns = stamp_ns
        self._stamped += 1

    def check(self) -> str:
        """Rate, duplicates, steps back, longest interval; missing samples where the stamps lie on a grid."""
        span_ns = self._last_ns - self._first_ns
        if span_ns == 0:
            return ""
        rate = (self._stamped - 1) / (span_ns * 1e-9)
        found = f", {rate:.3f} Hz, {self._duplicates} duplicates, {self._backwards} backwards"
        if self.is_stream and self._on_grid:
            found += f", {span_ns // self._period_ns + 1 - (self._stamped - self._duplicates)} missing"
        return f"{found}, longest interval {self._longest_ns * 1e-6:.3f} ms"


class Recorder(GraphNode):
    """Callbacks only queue; the bag's own thread writes."""

    def __init__(self, **options: Any) -> None:
        super().__init__("recorder", PARAMETERS, **options)
        values = self.values
        if not values["path"]:
            raise InputError("parameter path is missing: name the folder of the bag")
        if not values["topics"]:
            raise InputError("parameter topics is empty: name what to record")
        self._paused = self._closed = False
        self._skipped = 0
        self._wall = Clock()
        self._simulated_ns = 0
        self._streams: list[Track] = []  # filled when every topic has been found
        self._ack = (
            Acknowledger(self, values["window"], self.period_ns, values["count"]) if self.lockstep else None
        )
        self._bag = LiveBag(
            Path(values["path"]), values["storage"], values["flush_period"], values["queue_size"]
        )
        self._bag.open()
        self.workers.append(self._bag)
        self._tracks = {self.resolve_topic_name(topic): Track(self.period_ns) for topic in values["topics"]}
        self._inputs = {topic: self._subscribe(topic, track) for topic, track in self._tracks.items()}
        self.create_service(Trigger, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/resume", self._on_resume)

    def begin(self) -> None:
        """Nothing to start: the bag's thread runs since the bag was opened."""

    def figures(self) -> dict[str, str]:
        figures = {
            "path": self.values["path"],
            "queued": str(len(self._bag)),
            "dropped": str(self._bag.dropped),
            "lost": str(sum(sub.lost for sub in self._inputs.values())),
            "not_recorded_while_paused": str(self._skipped),
        }
        for topic, track in self._tracks.items():
            checked = track.check() if self._closed else ""
            figures[topic] = f"{track.received} messages{checked}"
        return figures

    def obstacles(self) -> list[str]:
        return [f"no publisher of {topic}" for topic, sub in self._inputs.items() if not sub.matched]

    def close(self) -> None:
        self._closed = True
        super().close()

    def _subscribe(self, topic: str, track: Track) -> AdaptiveSubscription:
        def found(type_name: str, publishers: Sequence[TopicEndpointInfo]) -> None:
            fields = message_type(type_name).get_fields_and_field_types()
            track.type_name = type_name
            track.has_header = next(iter(fields.values()), "") == "std_msgs/Header"
            self._bag.add_topic(topic, type_name, publishers)
            if all(known.type_name for known in self._tracks.values()):
                self._streams = [known for known in self._tracks.values() if known.is_stream]

        def receive(data: bytes, received_ns: int) -> None:
            self._receive(topic, track, data, received_ns)

        return AdaptiveSubscription(self, topic, receive, found)

    def _receive(self, topic: str, track: Track, data: bytes, received_ns: int) -> None:
        track.received += 1
        stamp_ns = stamp_of(data) if track.has_header else 0
        if self._paused:
            self._skipped += 1
        else:
            if track.has_header:
                track.add(stamp_ns)
            self._bag.put(topic, self._receive_time(track, stamp_ns, received_ns), data)
        if self._ack is not None and self._streams:
            self._ack.taken(min([stream.received for stream in self._streams]))

    def _receive_time(self, track: Track, stamp_ns: int, received_ns: int) -> int:
        """When the middleware received it, or in lockstep the simulated time: the newest stamp of any stream."""
        if not self.lockstep:
            return received_ns or self._wall.now()
        if track.is_stream:
            self._simulated_ns = max(self._simulated_ns, stamp_ns)
            return stamp_ns
        return self._simulated_ns

    def _on_pause(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = not self._paused
        response.message = "" if response.success else "already paused"
        self._paused = True
        return response

    def _on_resume(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._paused
        response.message = "" if response.success else "not paused"
        self._paused = False
        return response


def main() -> None:
    run(Recorder)


if __name__ == "__main__":
    main()
