"""Permission to command: one node per topic. A second publisher is named and counted, and its messages are ignored. Another node that
publishes when the first has gone, as a second one does that was found late, is one too many as well; the same node may come back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .sequence_check import SequenceCheck

_LOOK_PERIOD = (
    0.02  # seconds between two checks of the publishers: a fifth of the time in which effort has to be zero
)

UNNAMED = "unnamed node"
"""What a publisher's node is called while its name, which comes after the publisher, is not known."""


class Authority:
    """Monitors the publishers of `topic`. `intrusion(reason)` is called when a second publisher appears, and again when its node's
    name is known; and when another node has taken the place of the one whose messages were admitted.

    Attributes
    ----------
    topic : its full name.
    """

    def __init__(self, node: Node, topic: str, intrusion: Callable[[str], None]) -> None:
        self.topic = node.resolve_topic_name(topic)
        self._node, self._intrusion = node, intrusion
        self._sequence = SequenceCheck()
        self._accepted = ""  # full name of the node whose messages are admitted, once it is known
        self._told = ""  # the present conflict
        self._publishers = ""  # the newest conflict so far
        self._timer = node.create_timer(_LOOK_PERIOD, self._look)

    @property
    def foreign(self) -> int:
        """Ignored messages of other publishers."""
        return self._sequence.foreign

    def figures(self) -> dict[str, str]:
        """For /diagnostics; the publishers only where there are too many."""
        said = {"foreign_messages": str(self.foreign)}
        return {**said, "conflict": self._publishers} if self._publishers else said

    def admits(self, about: Mapping[str, Any]) -> bool:
        """Whether a message comes from the accepted publisher, according to the middleware's information about it."""
        admitted = self._sequence.admits(about["publication_sequence_number"], self._count)
        if not admitted:
            self._look()
        return admitted

    def conflict(self) -> str:
        """Which publishers there are, if there is more than one; else empty."""
        if self._count() <= 1:
            return ""
        found = self._node.get_publishers_info_by_topic(self.topic)
        names = sorted(map(_name, found))
        return f"{len(names)} publishers of {self.topic}: {', '.join(names)}" if len(names) > 1 else ""

    def _successor(self) -> str:
        """Which node publishes in the place of the accepted one; empty where none does."""
        found = self._node.get_publishers_info_by_topic(self.topic) if self._sequence.begun else []
        name = _name(found[0]) if len(found) == 1 else UNNAMED
        if name.startswith(UNNAMED):
            return ""
        self._accepted = self._accepted or name
        return (
            "" if name == self._accepted else f"{name} publishes on {self.topic} in place of {self._accepted}"
        )

    def _count(self) -> int:
        return self._node.count_publishers(self.topic)

    def _look(self) -> None:
        conflict = self.conflict() or self._successor()
        if conflict and conflict != self._told:
            self._publishers = conflict
            if not self._told or UNNAMED in self._told:
                self._intrusion(conflict)
        self._told = conflict


def _name(publisher: TopicEndpointInfo) -> str:
    """Full name of a publisher's node; the publisher's identifier until the node's name is known."""
    if "UNKNOWN" in publisher.node_name:
        return f"{UNNAMED} {bytes(publisher.endpoint_gid).hex()}"
    return f"{publisher.node_namespace.rstrip('/')}/{publisher.node_name}"
