"""recorder: writes topics of any type to a bag, reports lost messages, and leaves a valid bag if possible.

Services, named as rosbag2's recorder names them: `~/pause`, `~/resume`, `~/toggle_paused`, `~/is_paused` and
`~/split_bagfile`. Their type is std_srvs/Trigger, because rosbag2_interfaces is not always available; the answer of `~/is_paused`
is `success`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from rclpy.topic_endpoint_info import TopicEndpointInfo
from std_srvs.srv import Trigger

from rhythmid.errors import InputError

from .bag import LiveBag, Storage
from .clock import Clock
from .joint_state import stamp_of
from .lockstep import Acknowledger
from .node import COUNT, RATE, TIME_MODE, WINDOW, GraphNode, run
from .parameters import Parameter
from .qos import AdaptiveSubscription, message_type
from .stamp_order import Message, StampOrder
from .track import Track

_LOOK_PERIOD = 0.2  # seconds between two checks for topics whose names match
_STATE = "run"  # what the excitation says when it begins and when it ends; it bears no stamp
_TEXT = "std_msgs/msg/String"
PARAMETERS = (
    RATE,
    TIME_MODE,
    WINDOW,
    COUNT,
    Parameter("path", "", "folder of the bag; must not exist"),
    Parameter("storage", "mcap", "file format", choices=("mcap", "sqlite3")),
    Parameter("topics", ["excitation", "joint_states", "forcing", "run"], "what to record, whether or not it is there yet"),
    Parameter("regex", "", "records also every topic whose full name this regular expression finds; realtime only"),
    Parameter("exclude_regex", "", "of the topics that `regex` finds, those that are left out"),
    Parameter("start_paused", False, "records nothing until ~/resume is called"),
    Parameter("flush_period", 1.0, "time after which what was received survives a crash", "s", (0.1, 60.0)),
    Parameter("queue_size", 200_000, "messages waiting for the disk at most; more are dropped", "", (1, 10**7)),
    Parameter("max_bagfile_size", 0, "size of the messages at which the next file is begun; 0: none", "bytes", (0, 2**62)),
    Parameter("max_bagfile_duration", 0.0, "time after which the next file is begun; 0: none", "s", (0.0, 1e9)),
)  # fmt: skip


class Recorder(GraphNode):
    """Callbacks only queue; the bag's own thread writes."""

    def __init__(self, **options: Any) -> None:
        super().__init__("recorder", PARAMETERS, **options)

    def configure(self) -> None:
        values = self.values
        self._regex, self._exclude = self._expression("regex"), self._expression("exclude_regex")
        # `topics` has a default, and who gives an expression instead does not want it
        named = [] if self._regex and not self._given("topics") else values["topics"]
        if not values["path"]:
            raise InputError("parameter path is missing: name the folder of the bag")
        if not named and not self._regex:
            raise InputError("parameter topics is empty: name what to record")
        if self._regex and self.lockstep:
            raise InputError("parameter regex: in lockstep every topic must be named; use topics")
        self._paused, self._closed = values["start_paused"], False
        self._skipped = 0
        self._wall = Clock()
        self._simulated_ns = 0
        self._streams: list[Track] = []  # filled when every topic has been found
        self._order: StampOrder | None = None  # in lockstep, when every topic has been found
        self._early: list[Message] = []  # what came before
        self._found: dict[str, tuple[str, Sequence[TopicEndpointInfo]]] = {}
        self._ack = (
            Acknowledger(self, values["window"], self.period_ns, values["count"]) if self.lockstep else None
        )
        self._bag = LiveBag(
            Storage(
                Path(values["path"]), values["storage"], values["flush_period"], values["queue_size"],
                values["max_bagfile_size"], values["max_bagfile_duration"], by_message_time=self.lockstep,
            )
        )  # fmt: skip
        self._bag.open()
        self.workers.append(self._bag)
        self._tracks: dict[str, Track] = {}
        self._inputs: dict[str, AdaptiveSubscription] = {}
        for topic in dict.fromkeys(self.resolve_topic_name(name) for name in named):
            self._tracks[topic] = Track(self.period_ns)
        for topic in self._tracks:
            self._subscribe(topic)
        if self._regex:
            self.create_timer(_LOOK_PERIOD, self._look_for_topics)
        for name, act in {
            "pause": self._pause,
            "resume": self._resume,
            "toggle_paused": self._toggle,
            "is_paused": lambda: (self._paused, "paused" if self._paused else "recording"),
            "split_bagfile": self._split,
        }.items():
            self.create_service(Trigger, f"~/{name}", _answering(act))

    def activate(self) -> None:
        """Nothing to start: the bag's thread has been running since the bag was opened."""

    def deactivate(self) -> None:
        """Nothing to stop: received messages are still written."""

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

    def finish(self) -> None:
        if self.lockstep and not self._closed:
            if self._order is None:  # not every topic was found
                self._begin_order()
            assert self._order is not None
            self._put_all(self._order.rest())
        self._closed = True

    # Topics

    def _given(self, name: str) -> bool:
        return name in self._parameter_overrides

    def _expression(self, name: str) -> re.Pattern[str] | None:
        try:
            return re.compile(self.values[name]) if self.values[name] else None
        except re.error as error:
            raise InputError(
                f"parameter {name} = {self.values[name]!r} is no regular expression: {error}"
            ) from None

    def _look_for_topics(self) -> None:
        for topic, types in self.get_topic_names_and_types():
            if topic in self._tracks or not self._regex or not self._regex.search(topic):
                continue
            if self._exclude and self._exclude.search(topic):
                continue
            self._tracks[topic] = Track(self.period_ns)
            try:
                message_type(types[0])
            except InputError as problem:
                self.get_logger().warning(f"{topic} is not recorded: {problem}")
            else:
                self._subscribe(topic)

    def _subscribe(self, topic: str) -> None:
        track = self._tracks[topic]

        def found(type_name: str, publishers: Sequence[TopicEndpointInfo]) -> None:
            fields = message_type(type_name).get_fields_and_field_types()
            track.type_name = type_name
            track.has_header = next(iter(fields.values()), "") == "std_msgs/Header"
            if not self.lockstep:
                self._bag.add_topic(topic, type_name, publishers)
                return
            self._found[topic] = type_name, publishers
            if len(self._found) == len(self._tracks):
                self._begin_order()
                self._streams = [known for known in self._tracks.values() if known.is_stream]

        def receive(data: bytes, received_ns: int, sent_ns: int) -> None:
            self._receive(topic, track, data, received_ns, sent_ns)

        taken = self.while_active(receive) if self.lockstep else receive
        self._inputs[topic] = AdaptiveSubscription(self, topic, taken, found)

    def _begin_order(self) -> None:
        """Declare the topics, now that all are known, and write the messages that came before."""
        present = [topic for topic in self._tracks if topic in self._found]
        for topic in present:
            self._bag.add_topic(topic, *self._found[topic])
        state = self.resolve_topic_name(_STATE)
        streams = [topic for topic in present if self._tracks[topic].is_stream]
        self._order = StampOrder(present, streams, state if state in present else None)
        for message in self._early:
            self._order.add(*message)
        self._early.clear()

    # Messages

    def _receive(self, topic: str, track: Track, data: bytes, received_ns: int, sent_ns: int) -> None:
        track.received += 1
        if track.type_name == _TEXT:
            data = unpadded_text(data)
        stamp_ns = stamp_of(data) if track.has_header else 0
        if self._paused or not self.active:
            self._skipped += 1
        else:
            if track.has_header:
                track.add(stamp_ns)
            if self.lockstep:
                self._put_in_order(topic, track, stamp_ns, data)
            else:
                self._bag.put(topic, received_ns or self._wall.now(), data, sent_ns)
        if self._ack is not None and self._streams:
            self._ack.taken(min([stream.received for stream in self._streams]))

    def _put_in_order(self, topic: str, track: Track, stamp_ns: int, data: bytes) -> None:
        """In lockstep the receive time is the stamp; of a topic without one, the newest stamp of any stream."""
        if track.is_stream:
            self._simulated_ns = max(self._simulated_ns, stamp_ns)
        message = topic, stamp_ns if track.is_stream else self._simulated_ns, data
        if self._order is None:
            self._early.append(message)
        else:
            self._order.add(*message)
            self._put_all(self._order.ready())

    def _put_all(self, messages: Iterable[Message]) -> None:
        for message in messages:
            self._bag.put(*message)

    # Services: whether it was done, and why not

    def _pause(self) -> tuple[bool, str]:
        done, self._paused = not self._paused, True
        return done, "" if done else "already paused"

    def _resume(self) -> tuple[bool, str]:
        done, self._paused = self._paused, False
        return done, "" if done else "not paused"

    def _toggle(self) -> tuple[bool, str]:
        self._paused = not self._paused
        return True, "paused" if self._paused else "recording"

    def _split(self) -> tuple[bool, str]:
        self._bag.split()
        return True, ""


def unpadded_text(data: bytes) -> bytes:
    """A serialised std_msgs/String without the bytes by which some transports fill it up to a multiple of four."""
    return data[: 8 + int.from_bytes(data[4:8], "little" if data[1] else "big")]


def _answering(
    act: Callable[[], tuple[bool, str]],
) -> Callable[[Trigger.Request, Trigger.Response], Trigger.Response]:
    """A service that answers what `act` returns."""

    def serve(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = act()
        return response

    return serve


def main() -> None:
    run(Recorder)


if __name__ == "__main__":
    main()
