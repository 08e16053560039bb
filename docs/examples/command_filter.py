"""A node under test: passes commands on with a stamp 12 ms later, as a filter of that delay does.

It is plain rclpy. Of simulated time it keeps two rules: one message out for each one in, with a stamp that never goes back, and
topics that keep what is in flight for those who join late.
"""

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState

DELAY = Duration(nanoseconds=12_000_000)
KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class CommandFilter(Node):
    """Subscribes `input`, publishes `output`."""

    def __init__(self) -> None:
        super().__init__("command_filter")
        self._output = self.create_publisher(JointState, "output", KEPT)
        self.create_subscription(JointState, "input", self._on_command, KEPT)

    def _on_command(self, message: JointState) -> None:
        message.header.stamp = (Time.from_msg(message.header.stamp) + DELAY).to_msg()
        self._output.publish(message)


def main() -> None:
    rclpy.init()
    try:
        rclpy.spin(CommandFilter())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
