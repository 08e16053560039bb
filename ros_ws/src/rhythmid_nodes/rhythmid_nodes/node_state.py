"""Whether another managed node is active, by its service `~/get_state`."""

from __future__ import annotations

import time
from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rclpy.node import Node

_PATIENCE = 1.0  # seconds after which an unanswered request is repeated, because the node may have died


class NodeState:
    """The last reported state of the managed node `name`.

    Attributes
    ----------
    name : its full name.
    active : whether it was active; False before the first answer.
    """

    def __init__(self, node: Node, name: str) -> None:
        self.active = False
        self._client = node.create_client(GetState, f"{name}/get_state")
        self.name = self._client.service_name.removesuffix("/get_state")
        self._answer: Any = None
        self._asked_at = 0.0

    def ask(self) -> None:
        """Send the request, unless an answer is pending; to be called repeatedly."""
        if self._answer is not None and time.monotonic() - self._asked_at < _PATIENCE:
            return
        if self._answer is not None:
            self._client.remove_pending_request(self._answer)
            self.active, self._answer = False, None
        if self._client.service_is_ready():
            self._answer, self._asked_at = self._client.call_async(GetState.Request()), time.monotonic()
            self._answer.add_done_callback(self._hear)

    def _hear(self, answer: Any) -> None:
        if answer is self._answer:
            self.active = answer.result().current_state.id == State.PRIMARY_STATE_ACTIVE
            self._answer = None
