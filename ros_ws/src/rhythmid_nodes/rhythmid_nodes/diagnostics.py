"""/diagnostics: every node says at 1 Hz whether it is ready, what it waits for, and how well it keeps time."""

from __future__ import annotations

import time
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.node import Node

from .qos import latched

_LOOK_PERIOD = 0.05  # a change of readiness is told within this time, everything else at 1 Hz


class Diagnostics:
    """Publishes one DiagnosticStatus for `node`: level OK, or WARN while `obstacles()` names what keeps it from its work.

    `values()` are the key-value pairs.
    """

    def __init__(
        self, node: Node, values: Callable[[], dict[str, str]], obstacles: Callable[[], list[str]]
    ) -> None:
        self._node, self._values, self._obstacles = node, values, obstacles
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", latched(1))
        self._told = ""
        self._told_at = -1.0
        self._timer = node.create_timer(_LOOK_PERIOD, self._look)

    def _look(self) -> None:
        obstacles = "; ".join(self._obstacles())
        now = time.monotonic()
        if obstacles != self._told or now - self._told_at >= 1.0:
            self._publish(obstacles)
            self._told, self._told_at = obstacles, now

    def _publish(self, obstacles: str) -> None:
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if obstacles else DiagnosticStatus.OK,
            name=self._node.get_fully_qualified_name(),
            message=f"not ready: {obstacles}" if obstacles else "ok",
            hardware_id="",
            values=[KeyValue(key=key, value=value) for key, value in self._values().items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def publish_last(self) -> None:
        """The closing figures, delivered before the node goes."""
        self._publish("; ".join(self._obstacles()))
        self._publisher.wait_for_all_acked(Duration(seconds=0.5))
