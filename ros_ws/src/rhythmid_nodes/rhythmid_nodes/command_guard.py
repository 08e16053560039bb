"""command_guard: the last node before a robot. It forwards `command` within limits, and ends a command that is not renewed.

It takes no commands before a node receives its own. It sends the newest command at the robot's rate, never a backlog, with the robot's type on the robot's topic. The effort, its rate and
the power stay within their limits, whichever node commands. A second commander, a command that is not a number, or a machine in
danger (see `watch`) stop it: zero effort at once, and exit code 1.
"""

from __future__ import annotations

import math
import threading
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from rhythmid.errors import InputError
from rhythmid.simulation.command_hold import RAMP, TIMEOUT, CommandHold

from .authority import Authority
from .clock import Clock, Grid
from .command import STAMPED, TYPES, Commander
from .effort_limits import EffortLimits
from .joint_state import JointStateReader
from .node import JOINT, PRIORITY, RATE, TIME_MODE, GraphNode, lapse_notice, run
from .parameters import Parameter
from .qos import stream, subscribe_informed
from .receivers import Receivers
from .watch import Watch
from .watch_parameters import PARAMETERS as WATCHED
from .watch_parameters import limits

_FAR = math.inf
_LOOK_PERIOD = 0.05  # seconds between two checks for a robot that receives the commands
_INSIST = 0.5  # seconds for which zero is sent after the end of a command, because best-effort drives may miss a message
PARAMETERS = (
    RATE,
    TIME_MODE,
    JOINT,
    PRIORITY,
    Parameter("max_effort", 0.0, "largest |effort|", "N", (0.0, _FAR)),
    Parameter("max_effort_rate", _FAR, "largest change of the effort", "N/s", (0.0, _FAR)),
    Parameter("max_power", _FAR, "largest |effort times speed|, by joint_states", "W", (0.0, _FAR)),
    Parameter("command_timeout", TIMEOUT, "hold of a command that is not renewed; 0: for ever", "s", (0.0, 3600.0)),
    Parameter("command_ramp", RAMP, "fading of a command after that", "s", (0.0, 3600.0)),
    *WATCHED,
    Parameter("command_type", STAMPED, "message type that the robot takes", choices=tuple(TYPES)),
    Parameter("command_topic", "robot/command", "topic of the robot's commands"),
    Parameter("command_joints", None, "order of a Float64MultiArray's joints; not given: the one joint", items=str),
)  # fmt: skip


class CommandGuard(GraphNode):
    """Samples the newest command on its own grid. It is silent before the first command, and after the last one has ended."""

    def __init__(self, **options: Any) -> None:
        super().__init__("command_guard", PARAMETERS, **options)

    def configure(self) -> None:
        values = self.values
        if self.lockstep:
            raise InputError("parameter time_mode = 'lockstep': a robot has no simulated time")
        self._limits = EffortLimits(values["max_effort"], values["max_effort_rate"], values["max_power"])
        self._watch = Watch(
            limits(values), f"joint {values['joint']} on {self.resolve_topic_name('joint_states')}"
        )
        self._hold = self._new_hold()
        self._reader = JointStateReader(values["joint"])
        self._wall = Clock()
        self._lock = threading.Lock()  # of the hold: messages come on another thread than ticks
        self._sending = threading.Lock()
        self._obeys = False
        self._given = 0.0  # effort sent last
        self._given_ns = 0
        self._quiet_ns = 0  # when to fall silent
        self._commands = self._limited = self._other_joint = 0
        self._output = Commander(
            self, values["command_topic"], values["command_type"], values["joint"], values["command_joints"] or (),
            stream(lockstep=False),
        )  # fmt: skip
        self._authority = Authority(self, "command", self._stop)
        self._output_authority = Authority(self, self._output.publisher.topic, self._stop)
        self._receivers = Receivers(self, self._output.publisher)
        self._search = self.create_timer(_LOOK_PERIOD, self._listen)
        self.create_subscription(
            JointState, "joint_states", self._on_measurement, qos_profile_sensor_data, raw=True
        )
        self._grid = Grid(self._wall, self.period_ns, self._tick, values["priority"])
        self.workers.append(self._grid)

    def activate(self) -> None:
        self._hold = self._new_hold()
        self._obeys = True
        super().activate()

    def fade(self) -> None:
        """Zero effort at once and for some time: the nodes before the guard fade out, the guard cuts off."""
        self.stand_down()

    def fading(self) -> bool:
        return self._engaged(self._wall.now())

    def _new_hold(self) -> CommandHold:
        return CommandHold(self.values["command_timeout"], self.values["command_ramp"], self.period_ns)

    def figures(self) -> dict[str, str]:
        return {
            "commands": str(self._commands),
            "limited_commands": str(self._limited),
            "lapsed_commands": str(self._hold.lapses),
            "commands_of_other_joints": str(self._other_joint),
            **self._authority.figures(),
            **self._grid.figures(),
        }

    def obstacles(self) -> list[str]:
        found = [self._watch.danger(self._wall.now())]
        if self.count_publishers(self._authority.topic) == 0:
            found.append(f"no publisher of {self._authority.topic}")
        found.append(self._receivers.missing())
        return [obstacle for obstacle in found if obstacle]

    def stand_down(self) -> None:
        """A guard that is ended or deactivated ignores commands, and sends a last command of zero."""
        self._obeys = False
        if self._given_ns:
            self._zero()
            self._output.publisher.wait_for_all_acked(Duration(seconds=0.5))

    def _listen(self) -> None:
        """Subscribe to commands when somebody receives the guard's, so that whoever commands waits for that."""
        if self.configured and not self._receivers.missing():
            self._search.cancel()
            subscribe_informed(self, JointState, "command", self._on_command, stream(lockstep=False))

    def _on_command(self, data: bytes, about: dict[str, Any]) -> None:
        if not self._obeys or not self._authority.admits(about):
            return
        sample = self._reader.read(data)
        if sample is None:
            self._other_joint += 1
        elif not math.isfinite(sample.effort):
            self._stop(f"a command of {sample.effort} on {self._authority.topic}")
        else:
            with self._lock:
                self._commands += 1
                # the time of arrival counts, not that of processing on a busy computer
                self._hold.renew(min(self._wall.now(), about["received_timestamp"]), sample.effort)

    def _on_measurement(self, data: bytes) -> None:
        sample = self._reader.read(data)
        if sample is None:
            self._watch.hear_others(self._reader.names(data))
            return
        now = self._wall.now()
        self._watch.hear(sample, now)
        if self._obeys and self._engaged(now) and (danger := self._watch.danger(now)):
            self._stop(danger)

    def _engaged(self, now_ns: int) -> bool:
        """Whether effort is applied, or was shortly before."""
        return now_ns <= self._quiet_ns

    def _stop(self, reason: str) -> None:
        """Zero effort at once, regardless of the rate limit, and end of the process."""
        self._obeys = False
        self._zero()
        self.trip(reason)

    def _tick(self, stamp_ns: int) -> None:
        with self._lock:
            self._hold.until(stamp_ns)
            wanted = self._hold.effort if self._obeys else 0.0
        engaged = self._engaged(stamp_ns)
        danger = self._watch.danger(self._wall.now()) if wanted or engaged else ""
        if not danger and (wanted or engaged):
            self._give(stamp_ns, wanted)
        if self._hold.lapses and self._obeys:
            self.notice(lapse_notice(self.values["command_timeout"]))
        if (
            danger and engaged and self._obeys
        ):  # a guard that is being ended hears no measurements, and sends zero
            self._stop(danger)

    def _give(self, stamp_ns: int, wanted: float) -> None:
        effort = self._limits.apply(wanted, self._given, self.period_ns * 1e-9, self._watch.speed)
        self._limited += effort != wanted
        if effort:
            self._quiet_ns = stamp_ns + round(_INSIST * 1e9)
        self._send(stamp_ns, effort)

    def _zero(self) -> None:
        if self._given_ns:
            self._send(self._wall.now(), 0.0)

    def _send(self, stamp_ns: int, effort: float) -> None:
        with self._sending:
            effort = effort if self._obeys else 0.0  # nothing follows a last zero
            self._output.send(stamp_ns, effort)
            self._given, self._given_ns = effort, stamp_ns


def main() -> None:
    run(CommandGuard)


if __name__ == "__main__":
    main()
