"""plant: the machine. Takes `command`, publishes `plant/joint_states` and `forcing`; the physics is rhythmid's."""

from __future__ import annotations

import math
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.experiment import Forcing, Noise, plant_model
from rhythmid.model import Model
from rhythmid.simulation.command_hold import RAMP, TIMEOUT, CommandHold
from rhythmid.simulation.plant import Plant

from .authority import Authority
from .clock import Clock, Grid
from .effort_limits import EffortLimits
from .joint_state import JointStateReader, JointStateWriter
from .lateness import Lateness
from .lockstep import Acknowledger, Credit, block
from .node import SAMPLED, GraphNode, lapse_notice, run
from .parameters import Parameter
from .qos import stream, subscribe_informed

_LARGE = 1e12
PARAMETERS = (
    *SAMPLED,
    Parameter("max_effort", math.inf, "largest |effort| of a command; what exceeds it is clamped", "N", (0.0, math.inf)),
    Parameter("max_effort_rate", math.inf, "realtime: largest change of the effort", "N/s", (0.0, math.inf)),
    Parameter("max_power", math.inf, "realtime: largest |effort times speed of the plant|", "W", (0.0, math.inf)),
    Parameter("command_timeout", TIMEOUT, "hold of a command that is not renewed; 0: for ever", "s", (0.0, 3600.0)),
    Parameter("command_ramp", RAMP, "fading of a command after that", "s", (0.0, 3600.0)),
    Parameter("model", "", "model YAML file of the machine"),
    Parameter("elements", None, "folders with further elements that the model names", items=str),
    Parameter("forcing_amplitude", 1.0, "periodic forcing made on the machine; 0: none", "N", (-_LARGE, _LARGE)),
    Parameter("forcing_frequency", 1.0, "frequency of the forcing", "Hz", (1e-6, 1e6)),
    Parameter("forcing_phase", 0.0, "phase of the forcing", "rad", (-_LARGE, _LARGE)),
    Parameter("noise_std", 0.0, "measurement noise", "m", (0.0, _LARGE)),
    Parameter("noise_correlation", 0.0, "correlation of the noise from sample to sample", "", (0.0, 0.9999)),
    Parameter("quantisation", 0.0, "rounding step of the sensor; 0: none", "m", (0.0, _LARGE)),
    Parameter("seed", 0, "seed of the noise", "", (0, 2**31)),
    Parameter(
        "initial", None, "position [m] and velocity [m/s] at the start; not given: on the limit cycle", items=float
    ),
    Parameter("consumers", None, "lockstep: nodes whose announcements the plant waits for", items=str),
)  # fmt: skip


class PlantNode(GraphNode):
    """A thin node: messages in and out, clock or lockstep. The physics is in `rhythmid.simulation.plant.Plant`.

    A machine of several joints has another plant, other channels and another command, see `joint_plant`; all else is the same.
    """

    def __init__(self, parameters: tuple[Parameter, ...] = PARAMETERS, **options: Any) -> None:
        super().__init__("plant", parameters, **options)

    def configure(self) -> None:
        self._plant: Any = self._build()
        profile = stream(self.lockstep)
        self._open(profile)
        self._authority = Authority(self, "command", self.trip)
        self._commands = self._clamped = self._other_joint = self._samples = 0
        self._newest_ns = -1
        self._grid: Grid | None = None
        if self.lockstep:
            self._block = block(self.values["window"])
            self._block_stamps: list[int] = []
            self._block_efforts: list[Any] = []
            self._count = self.values["count"]
            if self._count == 0:
                raise InputError("parameter count = 0: in lockstep the number of samples must be known")
            self._ack = Acknowledger(self, self.values["window"], self.period_ns, self._count)
            self._credit = Credit(
                self,
                self.values["consumers"] or (),
                self.values["window"],
                self.period_ns,
                self._advance_lockstep,
            )
            subscribe_informed(self, JointState, "command", self.while_active(self._on_lockstep), profile)
        else:
            self._wall = Clock()
            self._origin_ns: int | None = (
                None  # of the plant's time; None before the first tick since activation
            )
            self._next_ns = 0  # time since the origin of the first tick after that
            self._transport = Lateness(self.period_ns)  # delay from the stamp of a command to its action
            self._done_ns = 0  # time since the origin up to which the plant has been integrated
            self._arrived: deque[tuple[int, int, Any]] = deque()
            subscribe_informed(self, JointState, "command", self._on_realtime, profile)
            self._grid = Grid(
                self._wall, self.period_ns, self._tick, self.values["priority"], self.values["catch_up"]
            )
            self.workers.append(self._grid)

    def _open(self, profile: QoSProfile) -> None:
        """Readers and writers of messages, their topics, and the treatment of commands."""
        self._reader: Any = JointStateReader(self.values["joint"])
        self._state_writer: Any = JointStateWriter(self.values["joint"], "position", "velocity", "effort")
        self._forcing_writer = JointStateWriter(self.values["joint"], "effort")
        self._states = self.create_publisher(JointState, "plant/joint_states", profile)
        self._forcing = self.create_publisher(JointState, "forcing", profile)
        self._hold: Any = CommandHold(
            self.values["command_timeout"], self.values["command_ramp"], self.period_ns
        )
        self._size = EffortLimits(size=self.values["max_effort"])
        self._limits = EffortLimits(math.inf, self.values["max_effort_rate"], self.values["max_power"])
        self._unlimited = self._limits == EffortLimits()
        if self.lockstep and not self._unlimited:
            raise InputError(
                "parameters max_effort_rate, max_power: in lockstep only the size of the effort is limited; limit the excitation"
            )
        self._wanted = self._given = self._speed = 0.0  # effort commanded and effort given last, newest speed
        self._given_ns = 0
        self._limited = 0

    def _build(self) -> Any:
        values = self.values
        if not values["model"]:
            raise InputError("parameter model is missing: name a model YAML file")
        initial = values["initial"]
        if initial is not None and len(initial) != 2:
            raise InputError(f"parameter initial = {initial}: position [m] and velocity [m/s] are expected")
        catalogue = load_catalogue(tuple(Path(folder) for folder in values["elements"] or ()))
        model = Model.of_one_axis(values["model"], catalogue)
        if model.term("periodic_forcing") is not None:
            model = model.without("periodic_forcing")
        forcing = Forcing(values["forcing_amplitude"], values["forcing_frequency"], values["forcing_phase"])
        noise = Noise(values["noise_std"], values["noise_correlation"], values["quantisation"])
        complete = plant_model(model, forcing, noise, catalogue)

        def plant() -> Plant:
            return Plant(complete, self.period_ns, values["seed"], tuple(initial) if initial else None)

        plant().advance(2 * self.period_ns)  # compiles now what would otherwise be compiled in the first tick
        return plant()

    def deactivate(self) -> None:
        """Time stands still for the machine; the last command no longer acts when it continues."""
        super().deactivate()
        if self._grid is not None:
            self._arrived.clear()
            self._drop_command(self._done_ns)
            self._origin_ns = None

    def figures(self) -> dict[str, str]:
        figures = {
            "samples": str(self._samples),
            "commands": str(self._commands),
            "clamped_commands": str(self._clamped),
            "lapsed_commands": str(self._hold.lapses),
            **self._authority.figures(),
        }
        if self._grid is None:
            return figures
        late = {
            **({} if self._unlimited else {"limited_commands": str(self._limited)}),
            "late_commands": str(self._transport.late),
            **self._transport.summary("transport"),
            "commands_of_other_joints": str(self._other_joint),
        }
        return {**figures, **late, **self._grid.figures()}

    def obstacles(self) -> list[str]:
        found = []
        if self.count_publishers(self._authority.topic) == 0:
            found.append(f"no publisher of {self._authority.topic}")
        if self._states.get_subscription_count() == 0:
            found.append(f"no subscriber of {self._states.topic}")
        return found

    def _accepted(self, data: bytes, about: dict[str, Any]) -> Any:
        """The command in a message, clamped; None if it has to be ignored."""
        if self.tripped or not self._authority.admits(about):
            return None
        sample = self._reader.read(data)
        if sample is None:
            self._other_joint += 1
            return None
        return self._within_limits(sample)

    def _within_limits(self, sample: Any) -> Any:
        """The command in a sample, clamped; None, and the node trips, if it is not a number."""
        if not math.isfinite(sample.effort):
            self.trip(f"a command of {sample.effort} on {self._authority.topic}")
            return None
        effort = self._size.apply(sample.effort, 0.0, 0.0)
        self._clamped += effort != sample.effort
        return sample._replace(effort=effort)

    def _tell_lapse(self) -> None:
        if self._hold.lapses:
            self.notice(lapse_notice(self.values["command_timeout"]))

    def _publish(self, until_ns: int, origin_ns: int, newest_only: bool = False) -> None:
        samples = self._plant.advance(until_ns)
        rows = zip(
            samples.stamp_ns.tolist(), samples.position.tolist(), samples.velocity.tolist(),
            samples.effort.tolist(), samples.forcing.tolist(), strict=True,
        )  # fmt: skip
        for stamp_ns, position, velocity, effort, forcing in list(rows)[-1 if newest_only else 0 :]:
            self._speed = velocity
            stamp_ns += origin_ns
            self._states.publish(self._state_writer.write(stamp_ns, position, velocity, effort))
            self._forcing.publish(self._forcing_writer.write(stamp_ns, forcing))
            self._samples += 1

    # Lockstep: a command with stamp s means that every command up to s is known, so the plant may continue to s.

    def _on_lockstep(self, data: bytes, about: dict[str, Any]) -> None:
        sample = self._accepted(data, about)
        if sample is None:
            if self._other_joint:
                raise InputError(f"a command does not name {self._named()}")
            return
        self._block_stamps.append(sample.stamp_ns)
        self._block_efforts.append(sample.effort)
        self._commands += 1
        if len(self._block_stamps) == self._block or self._commands >= self._count:
            stamps, efforts = np.array(self._block_stamps, dtype=np.int64), np.array(self._block_efforts)
            self._plant.push_many(*self._hold.fill(stamps, efforts))
            self._tell_lapse()
            self._newest_ns = sample.stamp_ns
            self._block_stamps.clear()
            self._block_efforts.clear()
            self._ack.taken(self._commands)
            self._advance_lockstep()

    def _named(self) -> str:
        return f"the joint {self.values['joint']!r}"

    def _advance_lockstep(self) -> None:
        last = min(self._credit.limit, self._count) - 1
        until_ns = min(self._newest_ns, last * self.period_ns)
        if until_ns >= self._samples * self.period_ns:
            self._publish(until_ns, origin_ns=0)

    # Real time: a command acts from its stamp on, which is when it was released, even between two ticks; one that
    # comes after the plant has passed its stamp acts at once; later than a sample period, it is counted as late.

    def _on_realtime(self, data: bytes, about: dict[str, Any]) -> None:
        sample = self._accepted(data, about)
        if sample is not None and self.active:
            self._arrived.append((sample.stamp_ns, self._wall.now(), sample.effort))

    def _tick(self, stamp_ns: int) -> None:
        if self._origin_ns is None:
            self._origin_ns = stamp_ns - self._next_ns
        while self._arrived:
            released_ns, received_ns, effort = self._arrived.popleft()
            act_ns = min(released_ns, received_ns) - self._origin_ns  # a foreign clock may be ahead of ours
            stamped_ns = act_ns
            act_ns = max(act_ns, self._done_ns, self._newest_ns + 1)
            self._transport.add(act_ns - stamped_ns)
            self._fade_until(act_ns - 1)
            self._push(act_ns, effort)
            self._hold.renew(act_ns, effort)
            self._commands += 1
        done_ns, self._done_ns = self._done_ns, stamp_ns - self._origin_ns
        if self.tripped:
            self._drop_command(done_ns)
        self._fade_until(self._done_ns)
        if not self._unlimited and not self.tripped:
            self._push(max(self._done_ns, self._newest_ns + 1), self._wanted)
        self._publish(self._done_ns, self._origin_ns, newest_only=True)
        self._next_ns = self._done_ns + self.period_ns

    def _drop_command(self, stamp_ns: int) -> None:
        """What is left without a command, from a time since the origin on."""
        left = self._nothing()
        self._give(max(stamp_ns, self._newest_ns + 1), left)
        self._wanted = left
        self._hold.renew(self._newest_ns, left)

    def _nothing(self) -> Any:
        """The command that replaces a missing one: zero effort."""
        return 0.0

    def _fade_until(self, stamp_ns: int) -> None:
        """The steps of a command that was not renewed, up to a time since the origin."""
        for step_ns, effort in self._hold.until(stamp_ns):
            self._push(step_ns, effort)
        self._tell_lapse()

    def _push(self, stamp_ns: int, effort: Any) -> None:
        """Apply an effort from a time on, within its limits of rate and power; the rest follows tick by tick."""
        self._wanted = effort
        if not self._unlimited:
            elapsed_ns = min(stamp_ns - self._given_ns, self.period_ns)
            effort = self._limits.apply(effort, self._given, elapsed_ns * 1e-9, self._speed)
            self._limited += effort != self._wanted
        self._give(stamp_ns, effort)

    def _give(self, stamp_ns: int, effort: Any) -> None:
        self._plant.push(stamp_ns, effort)
        self._newest_ns = self._given_ns = stamp_ns
        self._given = effort


def main() -> None:
    run(PlantNode)


if __name__ == "__main__":
    main()
