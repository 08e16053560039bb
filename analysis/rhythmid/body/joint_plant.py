"""A machine of several joints with commands as they arrive, used by the plant node and by the run without ROS.

Time is whole nanoseconds since the start of the run. The result depends only on the commands and their stamps, not
on the chunks in which they arrive. Until its first reference, a controller holds the start pose. The effort of a
sample is the mean over the sample period before it. The reason: a held reference jumps at the sampling instant, so
the actuator force at that instant differs from that between samples.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rhythmid.body import soft_constraint
from rhythmid.body.body import Array
from rhythmid.body.held_means import held_means
from rhythmid.body.live_source import rows_of
from rhythmid.body.machine import Machine
from rhythmid.body.path_source import COLUMNS
from rhythmid.body.simulate import (
    JointTrajectory,
    begin_of,
    compile_machine,
    pose_of,
    sampled,
    start_states,
    vector_of,
)
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.simulate import samplers
from rhythmid.simulation.transport import CommandPath, physical_times

FIELDS = ("position", "velocity", "effort")
Stamps = NDArray[np.int64]
WHOLE = 1e-6  # in steps: tolerance for the sample period to be a whole number of steps


class JointPlant:
    """A running machine.

    Parameters
    ----------
    machine : the robot, with the delays of its commands and measurements in its paths.
    period_ns : sample period [ns], a whole number of the body's steps.
    seed : of the noise.
    start : positions of joints at the start, at rest; the others begin at the reference pose.

    Raises InputError where the sample period is no whole number of steps.

    Attributes
    ----------
    held : commands (joints,) of the joints before the first command.
    """

    def __init__(
        self, machine: Machine, period_ns: int, seed: int = 0, start: Mapping[str, float] | None = None
    ) -> None:
        step = machine.body.step
        if abs((ratio := period_ns * 1e-9 / step) - round(ratio)) > WHOLE or ratio < 0.5:
            raise InputError(
                f"a sample period of {period_ns * 1e-9:g} s is no whole number of the body's steps of {step:g} s; "
                "change rate, or step under body"
            )
        self._machine, self._period, self._step = machine, period_ns, step
        self._stepping = compile_machine(machine)
        self._model, self._data = machine.body.worker()
        soft_constraint.put(self._model, machine.body.joints, machine.paths)
        first = np.zeros(1)
        earliest = min(float(physical_times(model, first)[0]) for model in machine.paths.values())
        self._begin = begin_of(0.0, earliest, step)
        pose = pose_of(machine, start or {})
        self._data.qpos[:], self._data.time = pose, self._begin
        places = [machine.body.joints[name] for name in machine.joints]
        self._at = np.array([one.position for one in places]), np.array([one.velocity for one in places])
        self.held = resting(machine, pose)
        layout = self._stepping.layout
        none = np.zeros(len(places))
        self._states = start_states(
            machine.paths, machine.body.joints, layout, pose, np.zeros(self._model.nv), self.held, none
        )
        self._parameters = vector_of(machine.paths, layout)
        self._past = np.empty((rows_of(machine.paths, step), layout.pasts))
        self._late = [_Transport(model) for model in machine.paths.values()]
        self._knots = np.empty((0, len(places)))  # times at which commands act at each joint
        self._levels = np.empty((0, len(places)))
        self._noise = [samplers(model, seed + place) for place, model in enumerate(machine.paths.values())]
        self._next = self._done = 0  # next sample of the grid, and next step
        self._rows = np.empty((0, len(COLUMNS) * len(places) + self._model.nq + self._model.nv))
        self._latest = np.full(len(places), -np.inf)  # times at which the newest measurements were taken
        self._newest = -1

    @property
    def joints(self) -> tuple[str, ...]:
        """The commanded joints, in the order of a command's numbers."""
        return self._machine.joints

    @property
    def measured(self) -> tuple[str, ...]:
        """The measured joints: the commanded ones, and that of the base where the base moves along one."""
        base = self._machine.body.base
        return (*self.joints, base) if base in self._machine.body.joints else self.joints

    def push_many(self, stamp_ns: Stamps, command: Array) -> None:
        """Commands (n, joints) that hold from their stamps (n,) on. Raises InputError when stamps do not increase."""
        if len(stamp_ns) == 0:
            return
        if stamp_ns[0] <= self._newest or np.any(np.diff(stamp_ns) <= 0):
            raise InputError(f"commands must come in the order of their stamps (at {int(stamp_ns[0])} ns)")
        command = np.asarray(command, dtype=float)
        if not np.isfinite(command).all():
            raise InputError(f"a command is not a finite number (at {int(stamp_ns[0])} ns)")
        self._newest = int(stamp_ns[-1])
        stamps = np.asarray(stamp_ns * 1e-9, dtype=float)
        acting = np.column_stack([late.acting(stamps) for late in self._late])
        self._knots = np.vstack([self._knots, acting])
        self._levels = np.vstack([self._levels, command])

    def push(self, stamp_ns: int, command: Array) -> None:
        """A command (joints,) that holds from its stamp on."""
        self.push_many(np.array([stamp_ns], dtype=np.int64), np.asarray(command)[None, :])

    def advance(self, until_ns: int) -> tuple[Stamps, JointTrajectory | None]:
        """Stamps and samples of the grid up to `until_ns` that have not been returned yet; all commands stamped up
        to then must be known.

        Raises InputError when the machine diverges.
        """
        last = until_ns // self._period
        stamps = np.arange(self._next, last + 1, dtype=np.int64) * self._period
        if len(stamps) == 0:
            return stamps, None
        times = (stamps * 1e-9).astype(np.float64)
        self._run(round((float(times[-1]) - self._begin) / self._step))
        physical = np.column_stack([late.physical(times) for late in self._late])
        physical = np.maximum(physical, self._latest)
        self._latest = physical[-1]
        first = self._done + 1 - len(self._rows)
        span = self._period * 1e-9
        made = sampled(self._machine, times, physical, self._rows, first, self._begin, self._noise, span)
        self._next = int(last) + 1
        kept = min(float(self._latest.min()), float(times[-1])) - span - 2.0 * self._step
        self._rows = self._rows[max(int((kept - self._begin) / self._step) - first, 0) :]
        return stamps, made

    def states(self, until_ns: int) -> tuple[Stamps, dict[str, Array]]:
        """Result of `advance` as the columns (n, measured joints) of joint states: position, velocity and effort."""
        stamps, made = self.advance(until_ns)
        if made is None:
            return stamps, {name: np.empty((0, len(self.measured))) for name in FIELDS}
        states = {"position": made.output, "velocity": made.velocity, "effort": made.effort}
        if len(self.measured) > len(self.joints):
            base = self._machine.body.joints[self._machine.body.base]
            further = made.pose[:, base.position], made.rate[:, base.velocity], np.zeros(len(stamps))
            states = {
                name: np.column_stack([one, more]) for (name, one), more in zip(states.items(), further)
            }
        return stamps, states

    def _run(self, last: int) -> None:
        """Simulate the steps up to the number `last`. The start of that step is returned; the step is made in the
        next run."""
        count = last + 1 - self._done
        edges = self._begin + self._step * np.arange(self._done, last + 2)
        command = np.empty((count, len(self.held)))
        held_means(self._knots, self._levels, edges, self.held, command)
        out = np.empty((count, self._rows.shape[1]))
        data, model = self._data, self._model
        done = self._stepping.run(
            model._address, data._address, data.qpos, data.qvel, data.qfrc_applied, model.dof_damping, *self._at, self._begin,
            self._step, command, np.zeros_like(command), self._parameters, self._states, self._past, out, self._done, True,
        )  # fmt: skip
        if done < count:
            at = self._begin + self._step * (self._done + done)
            raise InputError(f"the plant diverges at t = {at:.3f} s; check its parameters")
        rows = self._rows[:-1] if self._done or len(self._rows) else self._rows
        self._rows, self._done = np.vstack([rows, out]), last
        if len(self._knots):
            # another command already acts at all joints
            gone = int(np.sum(self._knots.max(axis=1) <= edges[-2])) - 1
            if gone > 0:
                self._knots, self._levels = self._knots[gone:], self._levels[gone:]


class _Transport:
    """Times at which commands act at a joint and measurements are taken; nothing is computed without delays."""

    def __init__(self, model: Model) -> None:
        self._model, self._path = model, CommandPath(model)
        slots = [term.element.slot for term in model.terms if term.element.delay is not None]
        self._command, self._measurement = "command" in slots, bool({"sensor", "timing"} & set(slots))

    def acting(self, stamps: Array) -> Array:
        """Times [s] at which commands with these stamps [s] act."""
        return self._path.times(stamps) if self._command else stamps

    def physical(self, stamps: Array) -> Array:
        """Times [s] at which measurements with these stamps [s] are taken."""
        return physical_times(self._model, stamps) if self._measurement else stamps


def resting(machine: Machine, pose: Array) -> Array:
    """Commands (joints,) before the first command: a controller holds the pose; without a controller there is no
    force."""
    return np.array(
        [
            pose[machine.body.joints[joint].position] if machine.controlled(joint) else 0.0
            for joint in machine.joints
        ]
    )
