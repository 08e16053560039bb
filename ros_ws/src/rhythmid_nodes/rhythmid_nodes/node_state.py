"""Whether another managed node is active, by its service `~/get_state`."""

from __future__ import annotations

import time
from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rclpy.node import Node

SERVICE = "get_state"  # of every managed node
PATIENCE = 3.0
"""Seconds after which an unanswered node counts as dead: longer than the 1 to 2 s for which the middleware may block a node that
publishes to a stopped subscriber (docs/safety.md). The middleware itself notices a killed process only after its lease (Fast DDS: 20 s)."""

_REPEAT = (
    1.0  # seconds after which the first request is repeated, because the node may have started meanwhile
)


class NodeState:
    """The last reported state of the managed node `name`.

    Attributes
    ----------
    name : its full name.
    active : whether it was active; False before the first answer.
    lost : why it is known not to work any more, after it has once answered: it has left, or does not answer; else empty.
    """

    def __init__(self, node: Node, name: str) -> None:
        self.active = False
        self.lost = ""
        self._answered = False
        self._node = node
        self._client = node.create_client(GetState, f"{name}/{SERVICE}")
        self.name = self._client.service_name.removesuffix(f"/{SERVICE}")
        self._answer: Any = None
        self._asked_at = 0.0

    def ask(self) -> None:
        """Send the request, unless an answer is pending; to be called repeatedly."""
        ready = self._client.service_is_ready()
        waited = time.monotonic() - self._asked_at
        if self._answer is not None and ready and waited < (PATIENCE if self._answered else _REPEAT):
            return
        if self._answer is not None:
            self._client.remove_pending_request(self._answer)
            self.active, self._answer = False, None
            self._lose("has left" if not ready else f"has not answered for {PATIENCE:g} s")
        if ready:
            self._answer, self._asked_at = self._client.call_async(GetState.Request()), time.monotonic()
            self._answer.add_done_callback(self._hear)
        else:
            self.active = False
            self._lose("has left")

    def close(self) -> None:
        """Ask no more."""
        self._node.destroy_client(self._client)

    def _lose(self, why: str) -> None:
        if self._answered:
            self.lost = f"{self.name} {why}"

    def _hear(self, answer: Any) -> None:
        if answer is self._answer:
            self.active = answer.result().current_state.id == State.PRIMARY_STATE_ACTIVE
            self.lost, self._answered, self._answer = "", True, None
