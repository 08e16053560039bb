"""The managed nodes without which an excitation is pointless: its recorder, and the receivers of its commands."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.publisher import Publisher

from .node_state import NodeState


class Companions:
    """Asks the recorder and the subscribers of `publisher` for their states. The middleware reports a killed process late; this does not.

    Subscribers that are no managed nodes, such as a robot, never answer, and are never `lost`.

    Attributes
    ----------
    recorder : state of the recorder; None where none is named.
    lost : full name of each lost receiver -> why it is lost.
    """

    def __init__(self, node: Node, publisher: Publisher, recorder: str) -> None:
        self.recorder = NodeState(node, recorder) if recorder else None
        self.lost: dict[str, str] = {}
        self._node, self._topic = node, publisher.topic_name
        self._receivers: dict[str, NodeState] = {}

    @property
    def unrecorded(self) -> str:
        """Message that the recorder is not active; empty if it is, or if none is named."""
        if self.recorder is None or self.recorder.active:
            return ""
        return self.recorder.lost or f"{self.recorder.name} is not active"

    def ask(self) -> None:
        """Send the requests that are due; to be called repeatedly."""
        found = {
            f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            for info in self._node.get_subscriptions_info_by_topic(self._topic)
            if "UNKNOWN" not in info.node_name  # its name comes later
        }
        for name in found - self._receivers.keys():
            self._receivers[name] = NodeState(self._node, name)
        for name in self._receivers.keys() - found:
            self._receivers.pop(name).close()
        if self.recorder is not None:
            self.recorder.ask()
        for receiver in self._receivers.values():
            receiver.ask()
        self.lost = {name: one.lost for name, one in self._receivers.items() if one.lost}
