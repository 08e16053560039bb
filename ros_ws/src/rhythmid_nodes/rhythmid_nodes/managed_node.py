"""A managed node (https://design.ros2.org/articles/node_lifecycle.html), with workers that run while it is active."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from .clock import Worker
from .lifecycle import ACTIVE, FINALIZED, UNCONFIGURED, FadingTransitions


class ManagedNode(LifecycleNode):
    """Calls the hooks below at the transitions. An exception in a hook ends the process.

    A node defines `configure`, which makes its publishers, subscriptions, services, timers and workers, and where it needs more
    than that the other hooks. What `configure` has made is destroyed by the transition cleanup.
    """

    lockstep = False

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.workers: list[Worker] = []
        self.active = False
        self.done = False  # set by a node whose work ends by itself; the process then ends
        self._refusal: Exception | None = None  # why a transition failed
        self._waiting: deque[Callable[[], None]] = (
            deque()
        )  # lockstep: messages that arrived while the node was not active
        self.transitions = FadingTransitions(self, self.fade, self.fading)

    def manage(self, autostart: bool) -> None:
        """Treat the present entities of the node as permanent, and configure it if it starts by itself. Raises the exceptions of `configure`."""
        self._permanent = {id(entity) for entity, _ in self._entities()}
        if autostart:
            self.trigger_configure()
            if self._refusal is not None:
                raise self._refusal

    @property
    def managed_state(self) -> str:
        """unconfigured, inactive, active, finalized, or the transition between."""
        return self._state_machine.current_state[1]

    @property
    def configured(self) -> bool:
        return self.managed_state not in (UNCONFIGURED, FINALIZED)

    # What a node defines

    def configure(self) -> None:
        """Create the node's publishers, subscriptions, services, timers and workers. Raises InputError for invalid parameters."""

    def activate(self) -> None:
        """Start the workers."""
        for worker in self.workers:
            worker.start()

    def deactivate(self) -> None:
        """Stop the effort and the workers."""
        self.stand_down()
        for worker in self.workers:
            worker.stop()

    def fade(self) -> None:
        """Begin to fade out the effort; called when the node is requested to leave the state active."""

    def fading(self) -> bool:
        """Whether the effort has not yet faded out."""
        return False

    def stand_down(self) -> None:
        """Stop the effort at once; called before the node ends, possibly more than once."""

    def finish(self) -> None:
        """End what `configure` has begun."""

    # Managed states

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._attempt(self.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._attempt(self._activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._attempt(self._deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._attempt(self._unconfigure)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        if state.label == ACTIVE:
            self._attempt(self._deactivate)
        if state.label != UNCONFIGURED:
            self._attempt(self._unconfigure)
        self.end()
        return TransitionCallbackReturn.SUCCESS

    def _attempt(self, action: Callable[[], None]) -> TransitionCallbackReturn:
        """Failure if `action` raises; what it raises then ends the process."""
        try:
            action()
        except Exception as problem:
            self._refusal = problem
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS

    def _activate(self) -> None:
        self.active = True
        while self._waiting:
            self._waiting.popleft()()
        self.activate()

    def _deactivate(self) -> None:
        self.active = False
        self.deactivate()

    def _unconfigure(self) -> None:
        """Undo `configure`."""
        self.finish()
        for worker in self.workers:
            worker.stop()
        self.workers.clear()
        self._waiting.clear()
        for entity, destroy in self._entities():
            if id(entity) not in self._permanent:
                destroy(entity)

    def _entities(self) -> list[tuple[Any, Callable[[Any], Any]]]:
        """All entities of the node at present, and how each is destroyed."""
        kinds = (
            (self.publishers, self.destroy_publisher), (self.subscriptions, self.destroy_subscription),
            (self.clients, self.destroy_client), (self.services, self.destroy_service), (self.timers, self.destroy_timer),
        )  # fmt: skip
        return [(entity, destroy) for entities, destroy in kinds for entity in list(entities)]

    def while_active(self, take: Callable[..., None]) -> Callable[..., None]:
        """`take` for messages that an inactive node does not process: in real time they are dropped, in lockstep they wait,
        and simulated time stands still."""

        def receive(*message: Any) -> None:
            if self.active:
                take(*message)
            elif self.lockstep:
                self._waiting.append(partial(take, *message))

        return receive

    @property
    def failure(self) -> BaseException | None:
        """Why a transition failed or a worker died, if one did."""
        died = (worker.failure for worker in self.workers if worker.failure is not None)
        return self._refusal or next(died, None)

    @property
    def ended_by_transition(self) -> bool:
        """Whether a transition ends the process: one that failed, or shutdown."""
        return self._refusal is not None or self.managed_state == FINALIZED

    def end(self) -> None:
        """Request the end of the process."""
        self.done = True
