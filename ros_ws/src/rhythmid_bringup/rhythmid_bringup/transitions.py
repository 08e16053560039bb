"""Requests state transitions of a managed node, over its service `~/change_state`."""

from __future__ import annotations

from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node

from rhythmid_nodes.lifecycle import INACTIVE, UNCONFIGURED

_NEXT = {UNCONFIGURED: Transition.TRANSITION_CONFIGURE, INACTIVE: Transition.TRANSITION_ACTIVATE}


class Transitions:
    """Requests transitions of the node `name`, one at a time and each only once, because its diagnostics report the new state later."""

    def __init__(self, node: Node, name: str) -> None:
        self._client = node.create_client(ChangeState, f"{name}/change_state")
        self._answer: Any = None
        self._number = 0  # of the transition that was requested last

    def advance(self, state: str) -> None:
        """Configure the node if it is unconfigured, activate it if it is inactive."""
        if state in _NEXT:
            self._request(_NEXT[state])

    def deactivate(self) -> None:
        """Deactivate the node, which fades out its effort."""
        self._request(Transition.TRANSITION_DEACTIVATE)

    def _request(self, number: int) -> None:
        if self._answer is not None and (not self._answer.done() or self._made(number)):
            return
        if self._client.service_is_ready():
            self._number = number
            self._answer = self._client.call_async(ChangeState.Request(transition=Transition(id=number)))

    def _made(self, number: int) -> bool:
        """Whether this transition was the last one that was requested, and has been made."""
        failed = self._answer.exception() is not None
        return number == self._number and not failed and self._answer.result().success
