"""Who receives the commands of a publisher. A recorder and the tools of the terminal listen too, but no command reaches a robot by them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher

_OF_RECORDERS = "split_bagfile"  # service that rosbag2's recorder and rhythmid's have, and no other node
_HIDDEN = "_"  # ROS 2 hides names that begin so: the tools `ros2 …`, and a node whose name is not yet known


def type_name(message: Any) -> str:
    """ROS name of a message class, such as `std_msgs/msg/Float64`."""
    return f"{message.__module__.partition('.')[0]}/msg/{message.__name__}"


def nobody_receives(
    topic: str, kind: str, subscribers: Sequence[tuple[str, str]], matched: int, services: Collection[str]
) -> str:
    """Message that no node receives the commands; empty if one does.

    Parameters
    ----------
    topic, kind
        Full name and message type of the commands.
    subscribers
        Full name of the node and message type of every subscription of the topic.
    matched
        How many of them the middleware has connected; it leaves out those with another type or an incompatible quality of service.
    services
        Full names of all services, by which a recorder is known.
    """
    same = [node for node, asked in subscribers if asked == kind]
    listeners = [
        node
        for node in same
        if node.rpartition("/")[2].startswith(_HIDDEN) or f"{node}/{_OF_RECORDERS}" in services
    ]
    if len(same) > len(listeners) < matched:
        return ""
    others = [f"{node} subscribes with {asked}" for node, asked in subscribers if asked != kind]
    refused = [f"{node} subscribes with another quality of service" for node in same if node not in listeners]
    why = ", ".join(dict.fromkeys((*others, *refused)))
    return f"no subscriber of {topic} [{kind}]" + (f" ({why})" if why else "")


class Receivers:
    """The receivers of what `publisher` sends."""

    def __init__(self, node: Node, publisher: Publisher) -> None:
        self._node, self._publisher = node, publisher
        self._topic, self._kind = publisher.topic_name, type_name(publisher.msg_type)
        self._received_by = (0, 0, 0)  # connected, known and dead subscribers when there was last a receiver

    def missing(self, lost: Mapping[str, str] = MappingProxyType({})) -> str:
        """Message that there is no receiver; empty if there is one. `lost` are dead subscribers that the middleware still knows, by
        their full names, with what is known about each."""
        matched = self._publisher.get_subscription_count()
        known = matched, self._node.count_subscribers(self._topic), len(lost)
        if matched and known == self._received_by:
            return ""
        everyone = [
            (f"{info.node_namespace.rstrip('/')}/{info.node_name}", info.topic_type)
            for info in self._node.get_subscriptions_info_by_topic(self._topic)
        ]
        found = [one for one in everyone if one[0] not in lost]
        matched -= len(everyone) - len(found)
        services = {name for name, _ in self._node.get_service_names_and_types()} if found else ()
        missing = nobody_receives(self._topic, self._kind, found, matched, services)
        if not missing:
            self._received_by = known
        elif lost:
            return f"{missing} ({', '.join(lost.values())})"
        return missing
