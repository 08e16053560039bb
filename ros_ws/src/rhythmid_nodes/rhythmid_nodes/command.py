"""Commands in the types that robots take: one joint's effort as JointState, Float64MultiArray or Float64."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

from rhythmid.errors import InputError

from .joint_state import JointStateWriter

STAMPED = "JointState"
TYPES: dict[str, type] = {STAMPED: JointState, "Float64MultiArray": Float64MultiArray, "Float64": Float64}


class Commander:
    """Publishes the effort of `joint` on `topic`, as the type of that name in `TYPES`.

    `joints` is the order of an array's numbers, as in the parameter `joints` of ros2_control's command controllers; the other
    joints get zero. Raises InputError when `joint` is not among them.
    """

    def __init__(
        self, node: Node, topic: str, kind: str, joint: str, joints: Sequence[str], profile: QoSProfile
    ) -> None:
        self._write = _writer(kind, joint, joints or [joint])
        self.publisher: Publisher = node.create_publisher(TYPES[kind], topic, profile)

    def send(self, stamp_ns: int, effort: float) -> None:
        """Publish an effort [N or N m]; only a JointState contains the stamp [ns]."""
        self.publisher.publish(self._write(stamp_ns, effort))


def _writer(kind: str, joint: str, joints: Sequence[str]) -> Callable[[int, float], Any]:
    if kind == STAMPED:
        return JointStateWriter(joint, "effort").write
    if kind == "Float64":
        return lambda _stamp_ns, effort: Float64(data=effort)
    if joint not in joints:
        raise InputError(f"parameter command_joints = {list(joints)}: the joint {joint!r} is not among them")
    index, data = list(joints).index(joint), [0.0] * len(joints)

    def write(_stamp_ns: int, effort: float) -> Float64MultiArray:
        data[index] = effort
        return Float64MultiArray(data=data)

    return write
