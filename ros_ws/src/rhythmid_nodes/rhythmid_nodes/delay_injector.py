"""delay_injector: forwards messages after a delay, constant or by a profile, without reading their content.

Remap the topics `input` and `output`. The order is kept: no message overtakes another, whatever the delay.
"""

from __future__ import annotations

import json
import threading
from collections import deque
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter as RosParameter
from std_msgs.msg import String

from rhythmid.errors import InputError
from rhythmid.settings import Delay, profile_delay

from .authority import Authority
from .clock import Clock, Worker
from .joint_state import restamped, stamp_of
from .lateness import Lateness
from .node import CATCH_UP, PRIORITY, RATE, TIME_MODE, GraphNode, run
from .parameters import Parameter
from .qos import AdaptiveSubscription, latched, message_type, stream

_SLICE_NS = 100_000_000  # the relay checks at least so often whether it should end
_SETTLE_NS = 20_000_000  # messages that arrive within this time after an overrun have waited in the transport
_LOOK_NS = 1_000_000  # between two checks for them

DELAY = Parameter("delay", 0.0, "time by which every message is held back", "s", (0.0, 10.0), settable=True)
PARAMETERS = (
    RATE,
    TIME_MODE,
    PRIORITY,
    CATCH_UP,
    DELAY,
    Parameter("profile", "", "CSV file of seconds since start and delay [s] that replaces `delay`; empty: none"),
    Parameter(
        "stamp_mode", "arrival", "header stamp on release: the time of release, or the original one",
        choices=("arrival", "keep"),
    ),
    Parameter(
        "delay_from", "header", "realtime: what the delay counts from; receive for a sender with another clock",
        choices=("header", "receive"),
    ),
    Parameter("type", "sensor_msgs/msg/JointState", "message type; its first field is a std_msgs/Header"),
    Parameter("one_publisher", True, "stop when a second node publishes on `input`"),
    Parameter("queue_size", 100_000, "messages held back at most; more are dropped and counted", bounds=(1, 10**7)),
)  # fmt: skip


class DelayInjector(GraphNode):
    """Holds messages for the delay; in lockstep it adds exactly the delay to the stamp and forwards them at once."""

    def __init__(self, **options: Any) -> None:
        super().__init__("delay_injector", PARAMETERS, **options)
        self.add_on_set_parameters_callback(self._on_set)

    def configure(self) -> None:
        values = self.values
        if self.lockstep and values["stamp_mode"] == "keep":
            raise InputError(
                "parameter stamp_mode = 'keep': in lockstep the stamp is the only clock; use 'arrival'"
            )
        self._type = message_type(values["type"])
        first = next(iter(self._type.get_fields_and_field_types().values()))
        if first != "std_msgs/Header":
            raise InputError(f"parameter type = {values['type']!r} has no header as its first field")
        self._profile = Delay(profile=Path(values["profile"])).table() if values["profile"] else None
        self._delay_ns = round(values["delay"] * 1e9)
        self._start_ns: int | None = 0 if self.lockstep else None
        self._last_ns = -1
        self._relayed = self._dropped = self._skipped = 0
        self._applied_ns = 0
        self._error = Lateness(self.period_ns)
        self._wall = Clock()
        self._queue: deque[tuple[int, int, bytes]] = deque()
        self._arrived = threading.Event()
        self._output = self.create_publisher(self._type, "output", stream(self.lockstep))
        self._authority = Authority(self, "input", self.trip) if values["one_publisher"] else None
        self._input = AdaptiveSubscription(
            self,
            "input",
            self.while_active(self._on_lockstep if self.lockstep else self._on_realtime),
            admits=self._admits,
        )
        if self._profile is not None and not self.lockstep:
            self.create_subscription(String, "run", self._on_run, latched())
        if not self.lockstep:
            self._relay = Worker("relay", self._release_due, values["priority"])
            self.workers.append(self._relay)

    def deactivate(self) -> None:
        super().deactivate()
        self._queue.clear()  # held messages are not released later

    def figures(self) -> dict[str, str]:
        applied = self._applied_ns / self._relayed * 1e-6 if self._relayed else 0.0
        figures = {
            "relayed": str(self._relayed),
            "lost": str(self._input.lost),
            "delay_ms": f"{self._delay_ns * 1e-6:.6f}" if self._profile is None else "profile",
            "applied_delay_mean_ms": f"{applied:.6f}",
            **(self._authority.figures() if self._authority else {}),
        }
        if self.lockstep:
            return figures
        queue = {
            "queued": str(len(self._queue)),
            "dropped": str(self._dropped),
            "skipped": str(self._skipped),
            "late": str(self._error.late),
        }
        return {**figures, **queue, **self._error.summary("delay_error")}

    def obstacles(self) -> list[str]:
        found = [] if self._input.matched else [f"no publisher of {self._input.topic}"]
        return (
            found
            if self._output.get_subscription_count()
            else [*found, f"no subscriber of {self._output.topic}"]
        )

    def _admits(self, about: dict[str, Any]) -> bool:
        return not self.tripped and (self._authority is None or self._authority.admits(about))

    def _on_set(self, parameters: list[RosParameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name == DELAY.name:
                try:
                    delay = DELAY.check(parameter.value)  # ROS's own range check accepts NaN
                except InputError as error:
                    return SetParametersResult(successful=False, reason=str(error))
                if self.values["profile"]:
                    return SetParametersResult(successful=False, reason="the delay follows a profile")
                self.get_logger().info(f"delay {self.values['delay']:g} s -> {delay:g} s")
                self.values["delay"] = delay
                self._delay_ns = round(delay * 1e9)
        return SetParametersResult(successful=True)

    def _on_run(self, message: String) -> None:
        self._start_ns = json.loads(message.data).get("start_ns", self._start_ns)

    def _delay_at(self, stamp_ns: int) -> int:
        """Delay [ns] of a message with this stamp; before the start of the run the profile's first value."""
        if self._profile is None:
            return self._delay_ns
        since = 0 if self._start_ns is None else stamp_ns - self._start_ns
        return int(profile_delay(since, *self._profile))

    def _on_lockstep(self, data: bytes, _received_ns: int, _sent_ns: int) -> None:
        stamp_ns = stamp_of(data)
        self._last_ns = max(stamp_ns + self._delay_at(stamp_ns), self._last_ns + 1)
        self._relayed += 1
        self._applied_ns += self._last_ns - stamp_ns
        self._output.publish(restamped(data, self._last_ns))

    def _on_realtime(self, data: bytes, received_ns: int, _sent_ns: int) -> None:
        origin_ns = (
            stamp_of(data) if self.values["delay_from"] == "header" else received_ns or self._wall.now()
        )
        if len(self._queue) >= self.values["queue_size"]:
            self._dropped += 1
            return
        self._last_ns = max(origin_ns + self._delay_at(origin_ns), self._last_ns + 1)
        self._queue.append((self._last_ns, origin_ns, data))
        self._arrived.set()

    def _release_due(self) -> None:
        stopping, catch_up_ns = self._relay.stopping, round(self.values["catch_up"] * 1e9)
        expected_ns = self._wall.now()
        while not stopping.is_set():
            now = self._wall.now()
            if now - expected_ns > catch_up_ns:
                self._leave_backlog(now)
                now = self._wall.now()
            expected_ns = now
            if not self._queue:
                expected_ns += _SLICE_NS
                self._arrived.wait(_SLICE_NS * 1e-9)
                self._arrived.clear()
            elif self._queue[0][0] > now:
                expected_ns = min(self._queue[0][0], now + _SLICE_NS)
                self._wall.sleep_until(expected_ns)
            else:
                self._release(*self._queue.popleft())

    def _release(self, due_ns: int, origin_ns: int, data: bytes) -> None:
        released_ns = self._wall.now()
        self._output.publish(data if self.values["stamp_mode"] == "keep" else restamped(data, released_ns))
        self._relayed += 1
        self._applied_ns += released_ns - origin_ns
        self._error.add(max(0, released_ns - due_ns))

    def _leave_backlog(self, resumed_ns: int) -> None:
        """After an overrun, keep only the newest of the messages that have waited."""
        self._await_backlog(resumed_ns)
        waited: list[tuple[int, int, bytes]] = []
        by_arrival = self.values["delay_from"] == "receive"
        while self._queue:
            due_ns, origin_ns, _ = self._queue[0]
            if not (origin_ns >= resumed_ns if by_arrival else due_ns <= self._wall.now()):
                break
            waited.append(self._queue.popleft())
        if waited:
            self._queue.appendleft(waited[-1])
            self._skipped += len(waited) - 1

    def _await_backlog(self, resumed_ns: int) -> None:
        """Wait until all messages in the transport have been read, which takes some time on a busy computer.

        Messages arrive in order, so the first one that was not due before the end of the overrun follows the backlog. The wait for it lasts
        as long as the computer may be late (`catch_up`). If the delay counts from receipt, the backlog is recognised only by the time.
        """
        look_ns = resumed_ns + _SETTLE_NS
        self._wall.sleep_until(look_ns)
        if self.values["delay_from"] == "receive":
            return
        end_ns = resumed_ns + round(self.values["catch_up"] * 1e9)
        while not (self._queue and self._queue[-1][0] > resumed_ns) and look_ns < end_ns:
            look_ns += _LOOK_NS
            self._wall.sleep_until(look_ns)


def main() -> None:
    run(DelayInjector)


if __name__ == "__main__":
    main()
