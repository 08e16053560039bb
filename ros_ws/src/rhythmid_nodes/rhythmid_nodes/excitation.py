"""excitation: publishes u(t) on `excitation` (or `command_topic`, as `command_type`) when told to, and stops by itself when the machine is not safe.

Services `~/start` and `~/stop` (std_srvs/Trigger); when deactivated, it first fades to zero. In real time it subscribes to `joint_states` and stops at once, with a
last command of zero, if the measurements violate their limits (see `watch`), there is no subscriber any more, or another node commands. It fades out
if nothing is recorded any more.
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

from .authority import UNNAMED, Authority
from .clock import Clock, Grid
from .command import STAMPED, Commander
from .companions import Companions
from .excitation_parameters import PARAMETERS
from .joint_state import JointStateReader
from .lateness import Lateness
from .lockstep import Credit
from .node import GraphNode, run, supervised
from .parameters import Parameter
from .qos import latched, stream
from .receivers import Receivers
from .watch import Watch
from .watch_parameters import limits

_COMPANY_PERIOD = 0.5  # seconds between two requests whether the recorder and the receivers still work


class ExcitationNode(GraphNode):
    """Plays a precomputed command, sample k at start + k periods.

    A machine of several joints has other commands and measurements, see `joint_excitation`; all else is the same.
    """

    HALTED = "the effort is zero at once, without fading"

    def __init__(self, parameters: tuple[Parameter, ...] = PARAMETERS, **options: Any) -> None:
        super().__init__("excitation", parameters, **options)

    def configure(self) -> None:
        self._effort = self._command()
        self._peak = float(np.max(np.abs(self._effort), initial=0.0))  # once: of an hour it takes 50 ms
        self._watch: Any = self._judge()
        self._state = "idle"  # idle -> running (-> ramping) -> finished | stopped
        self._sent = 0
        self._lateness = Lateness(self.period_ns)  # lateness of the sent commands relative to their stamps
        self._start_ns = 0
        self._fade_from: int | None = None
        self._fade_length = round(self.values["ramp"] * self.values["rate"])
        self._ended_at: float | None = None
        self._grid: Grid | None = None
        self._neighbours: set[str] = set()
        self._lock = threading.Lock()  # measurements and services come on another thread than ticks
        self._output: Any = self._commander()
        self._authority = Authority(self, self._output.publisher.topic, self._on_intrusion)
        self._receivers = Receivers(self, self._output.publisher)
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
            self._grid = Grid(
                self._wall, self.period_ns, self._tick, self.values["priority"], self.values["catch_up"]
            )
            self.workers.append(self._grid)
        self._companions = Companions(self, self._output.publisher, self.values["recorder"])
        self._recorded = False  # whether the recorder was active at the start
        if not self.lockstep and not supervised():
            self.create_timer(_COMPANY_PERIOD, self._look_for_company)
        if self.values["unattended"]:
            self.create_timer(0.05, self._attend)

    def activate(self) -> None:
        """In lockstep a run continues where it was; in real time the next start plays from the beginning."""
        if not self.lockstep:
            self._state, self._ended_at = "idle", None
        super().activate()
        self._send_lockstep()

    def fade(self) -> None:
        if not self.lockstep:
            self._fade_out()

    def fading(self) -> bool:
        return not self.lockstep and self._state in ("running", "ramping")

    def _judge(self) -> Any:
        """Reads and judges measurements."""
        self._reader: Any = JointStateReader(self.values["joint"])
        return Watch(
            limits(self.values), f"joint {self.values['joint']} on {self.resolve_topic_name('joint_states')}"
        )

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
        self._played = str(spec.get("type", "a command"))
        count = values["count"] or round(excitation.duration * values["rate"])
        grid = np.arange(count, dtype=np.int64) * self.period_ns * np.float64(1e-9)
        unit = "N m" if values["position_unit"] == "rad" else "N"
        if excitation.peak > values["max_effort"]:
            self.get_logger().warning(
                f"the excitation's peak of {excitation.peak:g} {unit} is clamped to max_effort = {values['max_effort']:g} {unit}"
            )
        safety = Safety(max_effort=values["max_effort"], ramp=values["ramp"])
        return ramped(excitation, safety, grid, count * self.period_ns * 1e-9)

    def _commander(self) -> Any:
        values = self.values
        if self.lockstep and values["command_type"] != STAMPED:
            raise InputError(
                f"parameter command_type = {values['command_type']!r}: in lockstep a command needs a stamp; use {STAMPED}"
            )
        return Commander(
            self, values["command_topic"], values["command_type"], values["joint"], values["command_joints"] or (),
            stream(self.lockstep),
        )  # fmt: skip

    def figures(self) -> dict[str, str]:
        return {
            "state": self._state,
            "sent": str(self._sent),
            "of": str(len(self._effort)),
            "other_graphs": ", ".join(self._other_graphs()),
            "peak_effort": f"{self._peak:g}",
            **(self._grid.figures() if self._grid else {}),
            **({} if self.lockstep else self._lateness.summary("lateness")),
        }

    def obstacles(self) -> list[str]:
        received = self._receivers.missing() if self.values["subscribers"] else ""
        found = [self._unheard() or received, self._authority.conflict(), self._unrecorded()]
        if not self.lockstep:
            found.append(self._watch.danger(self._wall.now()))
        return [obstacle for obstacle in found if obstacle]

    def _unheard(self) -> str:
        """Message on missing subscribers; empty if there are none."""
        matched, wanted = self._output.publisher.get_subscription_count(), self.values["subscribers"]
        if matched >= wanted:
            return ""
        return f"{matched} of {wanted} subscribers of {self._authority.topic}{self._unready_guards()}"

    def _unready_guards(self) -> str:
        """Names of command guards, which subscribe when they are ready, while the excitation waits; else empty."""
        if self._state != "idle":
            return ""
        nodes = self.get_node_names_and_namespaces()
        guards = sorted(f"{space.rstrip('/')}/{name}" for name, space in nodes if name == "command_guard")
        return f" ({', '.join(guards)} subscribes when the robot receives its commands)" if guards else ""

    def _unrecorded(self) -> str:
        """Message that the recorder is not active, for an unattended run; else empty."""
        return self._companions.unrecorded if self.values["unattended"] and self._state == "idle" else ""

    def _other_graphs(self) -> list[str]:
        """Namespaces of the other excitations in this DDS domain; each is reported once."""
        own = (self.get_name(), self.get_namespace())
        found = {space for name, space in self.get_node_names_and_namespaces() if name == own[0]} - {own[1]}
        for space in sorted(found - self._neighbours):
            self.get_logger().warning(f"another graph is in this DDS domain: {space}")
        self._neighbours |= found
        return sorted(found)

    def stand_down(self) -> None:
        """A node that is ended while it plays sends a last command of zero."""
        with self._lock:
            playing = not self.lockstep and self._state in ("running", "ramping")
            if playing:
                told = self._halt(self._wall.now(), "the node was ended or deactivated")
                self.get_logger().info(told)
        if playing:
            for publisher in (self._output.publisher, self._run):
                publisher.wait_for_all_acked(Duration(seconds=0.5))

    # Start and stop

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self._start()
        response.success = not response.message
        return response

    def _attend(self) -> None:
        if not self.active or self.transitions.leaving:
            return
        if self._state == "idle":
            self._companions.ask()
            self._start()
        elif self._state in ("finished", "stopped"):
            if self.lockstep and not self.tripped and self._credit.taken < len(self._effort):
                return
            self._ended_at = self._ended_at or time.monotonic()
            self.done = time.monotonic() - self._ended_at > 1.0

    def _look_for_company(self) -> None:
        """Stop when no node receives the commands any more, and fade out when the recorder that was active at the start is lost."""
        if not self.active:
            return
        self._companions.ask()
        if self._state not in ("running", "ramping"):
            return
        gone = self._receivers.missing(self._companions.lost) if self.values["subscribers"] else ""
        if gone:
            with self._lock:
                self._abort(self._wall.now(), gone)
        lost = self._companions.unrecorded if self._recorded else ""
        if lost and self._fade_out(f"nothing is recorded any more: {lost}"):
            self.get_logger().error(f"excitation stopped: {self.tripped}; the effort fades to zero")

    def _start(self) -> str:
        """Start playing from the beginning; returns the reason if this is refused."""
        with self._lock:
            if not self.active or self.transitions.leaving:
                return "not active"
            if self._state in ("running", "ramping"):
                return "already running"
            if self.lockstep and self._state != "idle":
                return "in lockstep a run cannot be repeated; start the graph anew"
            if obstacles := self.obstacles():
                return "; ".join(obstacles)
            self._sent, self._fade_from, self._lateness = 0, None, Lateness(self.period_ns)
            self.tripped = ""
            self._recorded = not self._companions.unrecorded
            if (
                not supervised()
            ):  # else the progress is shown; logged here, because a clock thread has no time for it
                self.get_logger().info(self._announcement())
            self._start_ns = 0 if self.lockstep else (self._wall.now() // self.period_ns + 2) * self.period_ns
            self._enter("running")
        if self.lockstep:
            self._send_lockstep()
        return ""

    def _on_stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = "" if self._fade_out() else f"not running: {self._state}"
        response.success = not response.message
        return response

    def _fade_out(self, failure: str = "") -> bool:
        """Begin to fade to zero, if it plays, because of a `failure` or on request."""
        with self._lock:
            playing = self._state == "running"
            if playing:
                self._state, self._fade_from, self.tripped = "ramping", self._sent, failure
        return playing

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

    def _value(self, index: int) -> Any:
        """u of sample `index`; faded out when asked to stop, zero after."""
        return float(self._effort[index]) * self._share(index)

    def _share(self, index: int) -> float:
        """Fraction of sample `index` that is played."""
        if self._fade_from is None:
            return 1.0
        return max(0.0, 1.0 - (index + 1 - self._fade_from) / max(1, self._fade_length))

    def _nothing(self) -> Any:
        """The last command of a run: zero effort."""
        return 0.0

    def _send(self) -> None:
        """Send sample `_sent`, the next one."""
        stamp_ns = self._start_ns + self._sent * self.period_ns
        self._output.send(stamp_ns, self._value(self._sent))
        self._sent += 1

    def _send_lockstep(self) -> None:
        """Send as many samples as the credit allows; after a stop, zeros up to the end, so that every stream has its full length."""
        with self._lock:
            if not self.active or self._state not in ("running", "ramping"):
                return
            while self._sent < min(self._credit.limit, len(self._effort)):
                self._send()
            if self._sent == len(self._effort):
                self._end()

    def _tick(self, stamp_ns: int) -> None:
        with self._lock:
            if self._state not in ("running", "ramping") or stamp_ns < self._start_ns:
                return
            if danger := self._unheard() or self._watch.danger(self._wall.now()):
                self._abort(stamp_ns, danger)
                return
            self._sent = (
                stamp_ns - self._start_ns
            ) // self.period_ns  # after an overrun, samples are left out
            faded = self._fade_from is not None and self._sent - self._fade_from >= self._fade_length
            if faded or self._sent >= len(self._effort):
                # whoever holds the last command holds nothing else from now on
                self._output.send(stamp_ns, self._nothing())
                self._end()
                return
            self._send()
            self._lateness.add(max(0, self._wall.now() - stamp_ns))

    def _end(self) -> None:
        if self._fade_from is None:
            self._enter("finished")
        else:
            self._enter("stopped", self.tripped or "asked to stop")
        if not supervised() and not self.tripped:
            how = self._state if self._fade_from is None else "faded out as asked"
            self.diagnostics.inform(
                f"excitation {how}: {self._sent} samples, {self._sent / self.values['rate']:g} s"
            )

    def _announcement(self) -> str:
        """What is played, for how long, and who records it."""
        recorder = self._companions.recorder
        by = (
            f"recorded by {recorder.name}"
            if recorder is not None and recorder.active
            else "no recorder is active"
        )
        return f"excitation starts: {self._played}, {len(self._effort) / self.values['rate']:g} s, {by}"

    def _halt(self, stamp_ns: int, reason: str) -> str:
        """Stop at once, without fading, with a last command of zero. Returns the line for the log."""
        if not self.lockstep:
            self._output.send(stamp_ns, self._nothing())
        self._enter("stopped", reason)
        return f"excitation stopped: {reason}; {self.HALTED}"

    def _on_intrusion(self, conflict: str) -> None:
        with self._lock:
            if UNNAMED in self.tripped:
                self.tripped = conflict
                self.report(f"excitation stopped: {conflict}; {self.HALTED}")
                self._enter("stopped", conflict)
            self._abort(self._wall.now(), conflict)

    def _abort(self, stamp_ns: int, danger: str) -> None:
        """Stop, if it plays, because the run has failed."""
        if self._state in ("running", "ramping"):
            self.tripped = danger
            self.report(self._halt(stamp_ns, danger))

    def _on_measurement(self, data: bytes) -> None:
        sample = self._reader.read(data)
        if sample is None:
            self._watch.hear_others(self._reader.names(data))
            return
        now = self._wall.now()
        self._watch.hear(sample, now)
        if danger := self._watch.danger(now):
            with self._lock:
                self._abort(now, danger)


def main() -> None:
    run(ExcitationNode)


if __name__ == "__main__":
    main()
