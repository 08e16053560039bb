"""The supervisor's own node: it subscribes to /diagnostics, `run` and `lockstep/ack`, and starts the excitation."""

from __future__ import annotations

import json
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import Header, String
from std_srvs.srv import Trigger

from rhythmid_nodes.diagnostics import NOT_READY, OK, STOPPED, status_name
from rhythmid_nodes.lifecycle import LIFECYCLE
from rhythmid_nodes.lockstep import ACK_TOPIC
from rhythmid_nodes.qos import latched

from .punctuality import timing
from .transitions import Transitions


class Observer(Node):
    """The observed state of the graph.

    Attributes
    ----------
    obstacles : node name -> reason why the node is not ready ("" if it is ready), from /diagnostics.
    tripped : node name -> reason, for nodes that stopped early.
    figures : node name -> its key-value pairs, the newest.
    heard : node name -> how many sets of figures have arrived.
    run : content of the topic `run`, the newest; empty before the start.
    excitation : requests the state transitions of the excitation.
    acknowledged_ns : simulated time up to which the recorder has everything (lockstep).
    """

    def __init__(self, namespace: str) -> None:
        super().__init__("supervisor", namespace=namespace)
        self.obstacles: dict[str, str] = {}
        self.tripped: dict[str, str] = {}
        self.figures: dict[str, dict[str, str]] = {}
        self.heard: dict[str, int] = {}
        self.run: dict[str, Any] = {}
        self.acknowledged_ns = 0
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, latched(100))
        self.create_subscription(String, "run", self._on_run, latched())
        self.create_subscription(Header, ACK_TOPIC, self._on_ack, latched())
        self._run = self.create_publisher(String, "run", latched())
        self._start = self.create_client(Trigger, "excitation/start")
        self.excitation = Transitions(self, "excitation")
        self._answer: Any = None
        self._started = False

    @property
    def state(self) -> str:
        """State of the excitation: "" before the start, then running, finished or stopped."""
        return self.run.get("state", "")

    def ask_start(self) -> str | None:
        """Request the start of the excitation, unless it is requested or has started; returns its refusal, if any."""
        if self._answer is None:
            if self._start.service_is_ready() and not self._started:
                self._answer = self._start.call_async(Trigger.Request())
            return None
        if not self._answer.done():
            return None
        response, self._answer = self._answer.result(), None
        self._started = response.success
        return None if response.success else response.message

    def lifecycle(self, node: str) -> str:
        """The managed state of a node, from /diagnostics; "" before the first report."""
        return self.figures.get(node, {}).get(LIFECYCLE, "")

    def tell_outcome(self, failure: str, punctual: bool) -> None:
        """Publish on `run`, if there was one, why it failed, foreign messages, and in real time the punctuality."""
        if not self.run:
            return
        foreign = {name: told for name in self.figures if (told := self._foreign(name))}
        said = {
            **self.run,
            **({"timing": timing(self.figures, self.run)} if punctual else {}),
            **({"failure": failure} if failure else {}),
            **({"foreign": foreign} if foreign else {}),
        }
        if said != self.run:
            self.run = said
            self._run.publish(String(data=json.dumps(said)))
            self._run.wait_for_all_acked(Duration(seconds=0.5))

    def _foreign(self, node: str) -> dict[str, Any]:
        """How many messages of a second publisher a node has refused, and who publishes; empty when there was none."""
        figures = self.figures[node]
        if "conflict" not in figures:
            return {}
        return {"messages": int(figures["foreign_messages"]), "conflict": figures["conflict"]}

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            namespace, _, name = status.name.rpartition("/")
            if namespace == status_name(self.get_namespace()):
                self.obstacles[name] = "" if status.message == OK else status.message.removeprefix(NOT_READY)
                if status.message.startswith(STOPPED):
                    self.tripped[name] = status.message.removeprefix(STOPPED)
                self.figures[name] = {pair.key: pair.value for pair in status.values}
                self.heard[name] = self.heard.get(name, 0) + 1

    def _on_run(self, message: String) -> None:
        self.run = json.loads(message.data)

    def _on_ack(self, header: Header) -> None:
        if header.frame_id == "recorder":
            self.acknowledged_ns = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
