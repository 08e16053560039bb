"""excitation: publishes u(t) on `excitation` (or `command_topic`, as `command_type`) when told to, and stops by itself when the machine is not safe.

Services `~/start` and `~/stop` (std_srvs/Trigger). In real time it listens to `joint_states` and stops at once, with a
last command of zero, when the newest measurement is older than `stale_after` or leaves `envelope`.
"""

from __future__ import annotations

import json
import threading
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.duration import Duration
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from rhythmid.errors import InputError
from rhythmid.excitation.sequence import build
from rhythmid.experiment import Safety, ramped

from .clock import Clock, Grid
from .command import STAMPED, TYPES, Commander
from .joint_state import JointStateReader
from .lateness import Lateness
from .lockstep import Credit
from .node import COUNT, JOINT, PRIORITY, RATE, TIME_MODE, WINDOW, GraphNode, run
from .parameters import Parameter
from .qos import latched, stream

_FAR = float("inf")
PARAMETERS = (
    RATE,
    TIME_MODE,
    JOINT,
    WINDOW,
    COUNT,
    PRIORITY,
    Parameter("excitation", "", "what to play, in JSON: the `excitation` of an experiment file"),
    Parameter("folder", ".", "where file names in it start"),
    Parameter("max_effort", 0.0, "largest |u|; what exceeds it is clamped", "N", (0.0, _FAR)),
    Parameter("ramp", 0.0, "fading in at the start and out at the end or on stop", "s", (0.0, 3600.0)),
    Parameter("stale_after", 0.5, "realtime: stop when the newest measurement is older; 0: never", "s", (0.0, _FAR)),
    Parameter("envelope", [-_FAR, _FAR], "realtime: stop when the position leaves [low, high] in m"),
    Parameter("command_type", STAMPED, "message type of the commands", choices=tuple(TYPES)),
    Parameter("command_topic", "excitation", "topic of the commands"),
    Parameter("command_joints", None, "order of a Float64MultiArray's joints; not given: the one joint", items=str),
    Parameter("run", "{}", "JSON published on `run`"),
    Parameter("subscribers", 1, "subscribers of the commands to wait for before starting", "", (0, 1000)),
    Parameter("unattended", False, "start as soon as ready and end the process a second after the last sample"),
    Parameter("consumers", ["plant", "recorder"], "lockstep: nodes whose announcements the excitation waits for"),
)  # fmt: skip


class ExcitationNode(GraphNode):
    """Plays a precomputed command, sample k at start + k periods."""

    def __init__(self, **options: Any) -> None:
        super().__init__("excitation", PARAMETERS, **options)
        self._effort = self._command()
        self._low, self._high = self._envelope()
        self._state = "idle"  # idle -> running (-> ramping) -> finished | stopped
        self._sent = 0
        self._lateness = Lateness(self.period_ns)  # of the commands sent, against their stamps
        self._start_ns = 0
        self._fade_from: int | None = None
        self._fade_length = round(self.values["ramp"] * self.values["rate"])
        self._seen_ns: int | None = None
        self._ended_at: float | None = None
        self._grid: Grid | None = None
        self._position = float("nan")
        self._lock = threading.Lock()  # measurements and services come on another thread than ticks
        self._reader = JointStateReader(self.values["joint"])
        self._output = self._commander()
        self._run = self.create_publisher(String, "run", latched())
        self.create_service(Trigger, "~/start", self._on_start)
        self.create_service(Trigger, "~/stop", self._on_stop)
        self._wall = Clock()
        if self.lockstep:
            self._credit = Credit(
                self, self.values["consumers"], self.values["window"], self.period_ns, self._send_lockstep
            )
        else:
            self.create_subscription(
                JointState, "joint_states", self._on_measurement, qos_profile_sensor_data, raw=True
            )
            self._grid = Grid(self._wall, self.period_ns, self._tick, self.values["priority"])
            self.workers.append(self._grid)
        if self.values["unattended"]:
            self.create_timer(0.05, self._attend)

    def _command(self) -> NDArray[np.float64]:
        """u(t) [N] on the grid, faded and clamped: the same numbers as in a run without ROS."""
        values = self.values
        try:
            spec = json.loads(values["excitation"])
        except json.JSONDecodeError as error:
            raise InputError(f"parameter excitation is not JSON: {error}") from None
        if not isinstance(spec, dict):
            raise InputError("parameter excitation must be a JSON object with a 'type'")
        excitation = build(spec, values["folder"])
        count = values["count"] or round(excitation.duration * values["rate"])
        grid = np.arange(count, dtype=np.int64) * self.period_ns * np.float64(1e-9)
        if excitation.peak > values["max_effort"]:
            self.get_logger().warning(
                f"the excitation's peak of {excitation.peak:g} N is clamped to max_effort = {values['max_effort']:g} N"
            )
        safety = Safety(max_effort=values["max_effort"], ramp=values["ramp"])
        return ramped(excitation, safety, grid, count * self.period_ns * 1e-9)

    def _commander(self) -> Commander:
        values = self.values
        if self.lockstep and values["command_type"] != STAMPED:
            raise InputError(
                f"parameter command_type = {values['command_type']!r}: in lockstep a command needs a stamp; use {STAMPED}"
            )
        return Commander(
            self, values["command_topic"], values["command_type"], values["joint"], values["command_joints"] or (),
            stream(self.lockstep),
        )  # fmt: skip

    def _envelope(self) -> tuple[float, float]:
        envelope = self.values["envelope"]
        if len(envelope) != 2 or not envelope[0] < envelope[1]:
            raise InputError(f"parameter envelope = {envelope}: two positions low < high in m are expected")
        return envelope[0], envelope[1]

    def figures(self) -> dict[str, str]:
        return {
            "state": self._state,
            "sent": str(self._sent),
            "of": str(len(self._effort)),
            "peak_effort": f"{np.max(np.abs(self._effort), initial=0.0):g}",
            **(self._grid.figures() if self._grid else {}),
            **({} if self.lockstep else self._lateness.summary("lateness")),
        }

    def obstacles(self) -> list[str]:
        found = []
        matched, wanted = self._output.publisher.get_subscription_count(), self.values["subscribers"]
        if matched < wanted:
            found.append(f"{matched} of {wanted} subscribers of {self._output.publisher.topic}")
        if not self.lockstep and (danger := self._danger()):
            found.append(danger)
        return found

    def _danger(self) -> str:
        """Why the machine must not be excited now; empty when it may."""
        stale = self.values["stale_after"]
        if self._seen_ns is None:
            return "no measurement on joint_states yet" if stale > 0.0 else ""
        age = (self._wall.now() - self._seen_ns) * 1e-9
        if age > stale > 0.0:
            return f"the newest measurement is {age:.3f} s old, allowed are {stale:g} s"
        if not self._low <= self._position <= self._high:  # NaN is outside, too
            return (
                f"the position {self._position:g} m is outside the envelope [{self._low:g}, {self._high:g}] m"
            )
        return ""

    def close(self) -> None:
        """A node that is ended while it plays leaves a last command of zero."""
        with self._lock:
            playing = not self.lockstep and self._state in ("running", "ramping")
            if playing:
                self._halt(self._wall.now(), "the node was ended")
        super().close()
        if playing:
            for publisher in (self._output.publisher, self._run):
                publisher.wait_for_all_acked(Duration(seconds=0.5))

    # Start and stop

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self._start()
        response.success = not response.message
        return response

    def _attend(self) -> None:
        if self._state == "idle":
            self._start()
        elif self._state in ("finished", "stopped"):
            if self.lockstep and self._credit.taken < len(self._effort):
                return
            self._ended_at = self._ended_at or time.monotonic()
            self.done = time.monotonic() - self._ended_at > 1.0

    def _start(self) -> str:
        """Start playing from the beginning; why not, if it may not."""
        with self._lock:
            if self._state in ("running", "ramping"):
                return "already running"
            if self.lockstep and self._state != "idle":
                return "in lockstep a run cannot be repeated; start the graph anew"
            if obstacles := self.obstacles():
                return "; ".join(obstacles)
            self._sent, self._fade_from, self._lateness = 0, None, Lateness(self.period_ns)
            self._start_ns = 0 if self.lockstep else (self._wall.now() // self.period_ns + 2) * self.period_ns
            self._enter("running")
        if self.lockstep:
            self._send_lockstep()
        return ""

    def _on_stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self._lock:
            response.success = self._state == "running"
            response.message = "" if response.success else f"not running: {self._state}"
            if response.success:
                self._state, self._fade_from = "ramping", self._sent
        return response

    def _enter(self, state: str, reason: str = "") -> None:
        self._state = state
        said = {**json.loads(self.values["run"]), "state": state, "start_ns": self._start_ns}
        if state != "running":
            said["samples"] = self._sent
            if not self.lockstep:
                said["timing"] = {"excitation": self._lateness.to_dict()}
        if reason:
            said["reason"] = reason
        self._run.publish(String(data=json.dumps(said)))

    # Playing

    def _value(self, index: int) -> float:
        """u of sample `index`; faded out when asked to stop, zero after."""
        effort = float(self._effort[index])
        if self._fade_from is None:
            return effort
        return effort * max(0.0, 1.0 - (index + 1 - self._fade_from) / max(1, self._fade_length))

    def _send(self) -> None:
        stamp_ns = self._start_ns + self._sent * self.period_ns
        self._output.send(stamp_ns, self._value(self._sent))
        self._sent += 1

    def _send_lockstep(self) -> None:
        """Send what the credit allows; after a stop, zeros up to the end, so that every stream has its full length."""
        with self._lock:
            if self._state not in ("running", "ramping"):
                return
            while self._sent < min(self._credit.limit, len(self._effort)):
                self._send()
            if self._sent == len(self._effort):
                self._end()

    def _tick(self, stamp_ns: int) -> None:
        with self._lock:
            if self._state not in ("running", "ramping") or stamp_ns < self._start_ns:
                return
            if danger := self._danger():
                self._halt(stamp_ns, danger)
                return
            faded = self._fade_from is not None and self._sent - self._fade_from >= self._fade_length
            if faded or self._sent >= len(self._effort):
                # whoever holds the last command holds zero from now on
                self._output.send(stamp_ns, 0.0)
                self._end()
                return
            self._send()
            self._lateness.add(max(0, self._wall.now() - stamp_ns))

    def _end(self) -> None:
        if self._fade_from is None:
            self._enter("finished")
        else:
            self._enter("stopped", "asked to stop")

    def _halt(self, stamp_ns: int, danger: str) -> None:
        """Stop at once, without fading, with a last command of zero."""
        self._output.send(stamp_ns, 0.0)
        self._enter("stopped", danger)
        self.get_logger().error(f"excitation stopped: {danger}")

    def _on_measurement(self, data: bytes) -> None:
        sample = self._reader.read(data)
        if sample is None:
            return
        with self._lock:
            self._position, self._seen_ns = sample.position, self._wall.now()
            if self._state in ("running", "ramping") and not self._low <= sample.position <= self._high:
                self._halt(self._wall.now(), self._danger())


def main() -> None:
    run(ExcitationNode)


if __name__ == "__main__":
    main()
