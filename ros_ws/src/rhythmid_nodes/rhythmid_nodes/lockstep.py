"""Simulated time without a clock: samples flow as fast as they are consumed, at most a credit window ahead.

Time starts at 0. Each consumer acknowledges on `lockstep/ack` (std_msgs/Header) the grid time up to which it has processed
everything; `frame_id` is the consumer's name. A source sends while its sample index is below the slowest consumer's
count plus the window. Streams are FIFO and reliable and keep a window for late joiners. So the data are independent of
the processes' layout, their speed, and their order of start.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from rclpy.node import Node
from std_msgs.msg import Header

from .qos import latched

ACK_TOPIC = "lockstep/ack"


def block(window: int) -> int:
    """Samples that are processed at a time. With a fifth of the window no source waits for an acknowledgement that its
    consumer has not yet sent, because at most two blocks are held along the path."""
    return max(1, window // 5)


class Acknowledger:
    """Acknowledges to the sources how many samples of the grid this node has processed, block by block and at the end."""

    def __init__(self, node: Node, window: int, period_ns: int, count: int) -> None:
        self._name = node.get_name()
        self._period_ns, self._block, self._count = period_ns, block(window), count
        self._told = 0
        self._publisher = node.create_publisher(Header, ACK_TOPIC, latched())

    def taken(self, samples: int) -> None:
        """`samples` have been processed in total."""
        if samples - self._told >= self._block or (samples >= self._count > self._told):
            header = Header(frame_id=self._name)
            header.stamp.sec, header.stamp.nanosec = divmod(samples * self._period_ns, 1_000_000_000)
            self._publisher.publish(header)
            self._told = samples


class Credit:
    """`taken`: samples that every consumer has taken in; `limit`: samples that the source may send, a window more."""

    def __init__(
        self, node: Node, consumers: Sequence[str], window: int, period_ns: int, granted: Callable[[], None]
    ) -> None:
        self._announced = dict.fromkeys(consumers, 0)
        self._window, self._period_ns, self._granted = window, period_ns, granted
        self.taken = 0
        self.limit = window if consumers else sys.maxsize
        node.create_subscription(Header, ACK_TOPIC, self._on_ack, latched())

    def _on_ack(self, header: Header) -> None:
        if header.frame_id not in self._announced:
            return
        stamp_ns = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
        self._announced[header.frame_id] = stamp_ns // self._period_ns
        self.taken = min(self._announced.values())
        if self.taken + self._window > self.limit:
            self.limit = self.taken + self._window
            self._granted()
