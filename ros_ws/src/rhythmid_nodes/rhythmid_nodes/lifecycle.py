"""The service `~/change_state` of a managed node whose effort fades before it leaves the state active."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode

_LOOK_PERIOD = 0.02  # seconds between two checks whether the effort has faded

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = "unconfigured", "inactive", "active", "finalized"
"""Labels of the states in which a node rests."""

LIFECYCLE = "lifecycle"
"""Key of the state among the figures on /diagnostics."""

_LEAVING = {
    Transition.TRANSITION_DEACTIVATE: ("deactivate",),
    Transition.TRANSITION_ACTIVE_SHUTDOWN: ("shutdown", "active_shutdown"),
}


class FadingTransitions:
    """Answers requests for transitions. A transition that leaves `active` first calls `fade()`. It is made and answered when
    `fading()` is over; until then the node is active. A transition that the present state does not have is refused.

    Attributes
    ----------
    leaving : whether the node fades in order to leave `active`.
    """

    def __init__(self, node: LifecycleNode, fade: Callable[[], None], fading: Callable[[], bool]) -> None:
        self._node, self._fade, self._fading = node, fade, fading
        service: Any = node._service_change_state  # rclpy has no public way to answer a transition later
        self._make, self._answer = service.callback, service.send_response
        service.callback, service.send_response = self._on_request, self._respond
        self._request: ChangeState.Request | None = None
        self._held: tuple[ChangeState.Response, Any] | None = None  # the waiting answer, and its recipient
        self._timer = node.create_timer(_LOOK_PERIOD, self._look)
        self._timer.cancel()

    @property
    def leaving(self) -> bool:
        return self._request is not None

    def _on_request(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        if self.leaving:
            response.success = False
        elif self._leaves_active(request):
            self._fade()
            self._request, self._held = request, (response, None)
        else:
            self._change(request, response)
        return response

    def _leaves_active(self, request: ChangeState.Request) -> bool:
        if self._node._state_machine.current_state[0] != State.PRIMARY_STATE_ACTIVE:
            return False
        label, number = request.transition.label, request.transition.id
        return any(label in labels if label else number == known for known, labels in _LEAVING.items())

    def _change(self, request: ChangeState.Request, response: ChangeState.Response) -> None:
        try:
            self._make(request, response)
        except rclpy_implementation.RCLError:  # no transition of this state
            response.success = False

    def _respond(self, response: ChangeState.Response, header: Any) -> None:
        """Send an answer, or hold it until the effort has faded."""
        if self._held is not None and self._held[0] is response:
            self._held = response, header
            self._timer.reset()
        else:
            self._answer(response, header)

    def _look(self) -> None:
        if self._request is None or self._held is None or self._fading():
            return
        self._timer.cancel()
        (response, header), request = self._held, self._request
        self._held = self._request = None
        self._change(request, response)
        self._answer(response, header)
