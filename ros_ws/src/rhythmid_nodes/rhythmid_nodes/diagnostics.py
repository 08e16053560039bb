"""/diagnostics: every node reports at 1 Hz whether it is ready, what it waits for, and its punctuality."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.node import Node

from .qos import latched

OK = "ok"
NOT_READY = "not ready: "
STOPPED = "stopped: "
"""What the message of a status is or begins with, for OK, WARN and ERROR."""

PREFIX = "rhythmid: "
"""What the name of every status begins with, by which an aggregator collects them."""

_LOOK_PERIOD = 0.05  # a change of readiness is reported within this time, everything else at 1 Hz


def status_name(node: str) -> str:
    """Name of a node's status by its fully qualified name: `rhythmid: hopper/plant`."""
    return PREFIX + node.strip("/")


class Diagnostics:
    """Publishes one DiagnosticStatus for `node`: level OK, WARN while `obstacles()` gives a reason why it is not ready, or
    ERROR if `tripped()` gives the reason why it stopped early.

    `values()` are the key-value pairs.
    """

    def __init__(
        self,
        node: Node,
        values: Callable[[], dict[str, str]],
        obstacles: Callable[[], list[str]],
        tripped: Callable[[], str] = lambda: "",
    ) -> None:
        self._node, self._values, self._obstacles, self._tripped = node, values, obstacles, tripped
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", latched(1))
        self._noticed: set[str] = set()
        self._notices: deque[tuple[Callable[[str], object], str]] = deque()
        self._told = ""
        self._told_at = -1.0
        self._timer = node.create_timer(_LOOK_PERIOD, self._look)

    def notice(self, text: str) -> None:
        """Have `text` logged as a warning, once, by the executor: the first log of a process takes tens of milliseconds, which
        a clock thread does not have."""
        if text not in self._noticed:
            self._noticed.add(text)
            self._notices.append((self._node.get_logger().warning, text))

    def inform(self, text: str) -> None:
        """Have `text` logged as information, by the executor, each time."""
        self._notices.append((self._node.get_logger().info, text))

    def _look(self) -> None:
        while self._notices:
            log, text = self._notices.popleft()
            log(text)
        message = self._message()
        now = time.monotonic()
        if message != self._told or now - self._told_at >= 1.0:
            self._publish(message)
            self._told, self._told_at = message, now

    def _message(self) -> str:
        if tripped := self._tripped():
            return f"{STOPPED}{tripped}"
        obstacles = "; ".join(self._obstacles())
        return f"{NOT_READY}{obstacles}" if obstacles else OK

    def _publish(self, message: str) -> None:
        level = DiagnosticStatus.ERROR if message.startswith(STOPPED) else DiagnosticStatus.WARN
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if message == OK else level,
            name=status_name(self._node.get_fully_qualified_name()),
            message=message,
            hardware_id=self._node.get_namespace().strip("/") or "machine",
            values=[KeyValue(key=key, value=value) for key, value in self._values().items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)

    def publish_last(self) -> None:
        """The final figures, delivered before the node ends."""
        self._publish(self._message())
        self._publisher.wait_for_all_acked(Duration(seconds=0.5))
