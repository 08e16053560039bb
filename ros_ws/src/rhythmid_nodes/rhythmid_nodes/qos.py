"""Quality of service: reliable between rhythmid's nodes, adapted to the offer of a robot on its topics."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from rhythmid.errors import InputError

from .sequence_gaps import SequenceGaps

WINDOW_MAX = 100
"""Largest credit window: more messages in flight than this overflow the transport's queues."""

_DISCOVERY_PERIOD = 0.05  # seconds between two checks for the first publisher
_ATTENTION_PERIOD_NS = 1_000_000_000  # between two checks for publishers that join later


def stream(lockstep: bool) -> QoSProfile:
    """A stream of samples. In lockstep late joiners get the messages in transit, so that none is lost."""
    durability = DurabilityPolicy.TRANSIENT_LOCAL if lockstep else DurabilityPolicy.VOLATILE
    return QoSProfile(
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
        history=HistoryPolicy.KEEP_LAST,
        depth=WINDOW_MAX if lockstep else 1000,
    )


def latched(depth: int = 10) -> QoSProfile:
    """State that late joiners must see: reliable, transient local."""
    return QoSProfile(
        reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL, depth=depth
    )


def adapted(publishers: Sequence[TopicEndpointInfo], depth: int) -> QoSProfile:
    """The strongest subscription that matches all `publishers` (rosbag2's rule)."""
    profiles = [publisher.qos_profile for publisher in publishers]
    reliable = all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles)
    latching = all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles)
    return QoSProfile(
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latching else DurabilityPolicy.VOLATILE,
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
    )


def weaker(profile: QoSProfile, than: QoSProfile) -> bool:
    """Whether `profile` matches publishers that a subscription with `than` does not."""
    best_effort, volatile = ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE
    return (profile.reliability == best_effort != than.reliability) or (
        profile.durability == volatile != than.durability
    )


def message_type(name: str) -> type:
    """The Python class of a ROS message type such as `sensor_msgs/msg/JointState`."""
    try:
        package, folder, message = name.split("/")
        return getattr(importlib.import_module(f"{package}.{folder}"), message)
    except (ValueError, ImportError, AttributeError):
        raise InputError(
            f"message type {name} is not installed here; install its package or leave the topic out"
        ) from None


def subscribe_informed(
    node: Node,
    message: type,
    topic: str,
    callback: Callable[[bytes, dict[str, Any]], None],
    profile: QoSProfile,
) -> Subscription:
    """A raw subscription whose `callback(data, about)` also gets the middleware's information about each message: times and number."""

    def receive(*taken: Any) -> None:
        callback(*(taken[0] if len(taken) == 1 else taken))

    subscription = node.create_subscription(message, topic, receive, profile, raw=True)
    # the events executor hands over message and info as one pair; rclpy would not ask for the info of such a callback
    subscription._callback_type = Subscription.CallbackType.WithMessageInfo
    return subscription


class AdaptiveSubscription:
    """A raw subscription that is created as soon as the type and quality of service of a publisher are known, and created again for a
    publisher that it would not match.

    `callback(data, received_ns, sent_ns)` gets a message, when the middleware received it [ns since the epoch], which on a
    busy machine is long before the callback's turn, and when it was published; 0 if the middleware does not say. `found(type_name, publishers)` is called once, before
    the first message. A message for which `admits(about)` is false is left out.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        callback: Callable[[bytes, int, int], None],
        found: Callable[[str, Sequence[TopicEndpointInfo]], None] | None = None,
        depth: int = 2000,
        admits: Callable[[dict[str, Any]], bool] = lambda _about: True,
    ) -> None:
        self.topic = node.resolve_topic_name(topic)
        self.subscription: Subscription | None = None
        self._gaps = SequenceGaps()
        self._node, self._callback, self._found, self._depth = node, callback, found, depth
        self._admits = admits
        self._timer = node.create_timer(_DISCOVERY_PERIOD, self._look)

    @property
    def matched(self) -> bool:
        return self.subscription is not None and self._node.count_publishers(self.topic) > 0

    @property
    def lost(self) -> int:
        """Number of messages that were sent before the newest one and did not arrive."""
        return self._gaps.lost

    def _look(self) -> None:
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        if not publishers:
            return
        if self.subscription is None:
            self._timer.timer_period_ns = _ATTENTION_PERIOD_NS
            if self._found is not None:
                self._found(publishers[0].topic_type, publishers)
            self._subscribe(publishers)
        elif weaker(adapted(publishers, self._depth), self._profile):
            self._node.destroy_subscription(self.subscription)
            self._subscribe(publishers)

    def _subscribe(self, publishers: Sequence[TopicEndpointInfo]) -> None:
        self._profile = adapted(publishers, self._depth)
        self.subscription = self._node.create_subscription(
            message_type(publishers[0].topic_type), self.topic, self._receive, self._profile, raw=True
        )
        # the events executor hands over message and info as one pair; rclpy would not ask for the info of such a callback
        self.subscription._callback_type = Subscription.CallbackType.WithMessageInfo

    def _receive(self, *taken: Any) -> None:
        data, about = taken[0] if len(taken) == 1 else taken
        if self._admits(about):
            self._gaps.add(about["publication_sequence_number"])
            self._callback(data, about["received_timestamp"], about["source_timestamp"])
