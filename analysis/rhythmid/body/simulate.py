"""Simulation of a machine of several joints."""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.body import soft_constraint
from rhythmid.body.body import Array, Joint
from rhythmid.body.held_means import held_means
from rhythmid.body.machine import Machine
from rhythmid.body.path_source import COLUMNS, Layout
from rhythmid.body.samples import mean_efforts, sample_columns, sample_joints
from rhythmid.body.stepping_source import generate
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.machine_code import load_run
from rhythmid.simulation.signal import FAR
from rhythmid.simulation.simulate import delayed_command, physical_times, samplers

Start = Mapping[str, float]
AT_ONCE = 2e7  # largest number of values in memory


@dataclass(frozen=True)
class JointTrajectory:
    """A run of a machine; the arrays (n, joints) have a column for each joint in `joints`.

    `time` [s] are the requested stamps. `output` holds the sensors' values. `position`, `velocity` and the
    actuators' forces `effort` are the true ones at these stamps minus the measurement delay. `pose` (n, nq) and
    `rate` (n, nv) are of the whole body at the stamps themselves.
    """

    time: Array
    joints: tuple[str, ...]
    position: Array
    velocity: Array
    effort: Array
    output: Array
    pose: Array
    rate: Array


@dataclass(frozen=True)
class Stepping:
    """The compiled loop of a structure of paths, for any parameter values."""

    layout: Layout
    run: Callable[..., int]


@dataclass(frozen=True, eq=False)
class _Paths:
    """Paths that are not part of the cache's key: machines that differ in values share one compiled loop."""

    paths: dict[str, Model]

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Paths)


@lru_cache(maxsize=64)
def _stepping(key: Hashable, paths: _Paths) -> Stepping:
    module, layout = generate(paths.paths)
    return Stepping(layout, load_run(module))


def compile_machine(machine: Machine) -> Stepping:
    """The compiled loop of a machine, independent of parameter values."""
    key = tuple(
        (
            joint,
            tuple(
                (t.label, t.element.name, t.element.slot, t.element.acts, t.element.own, t.element.history,
                 tuple(t.element.borrows.items()), getattr(t.element.kernel, "__code__", None))
                for t in model.terms
            ),
        )
        for joint, model in machine.paths.items()
    )  # fmt: skip
    return _stepping(key, _Paths(dict(machine.paths)))


def pose_of(machine: Machine, start: Start) -> Array:
    """Position vector (nq,) with the named joints at these positions and the others at the reference pose."""
    pose = machine.body.reference.copy()
    for name, value in start.items():
        pose[machine.body.joint(name).position] = value
    return pose


def means(signal: PPoly | None, begin: float, step: float, count: int) -> Array:
    """Mean (count,) of a signal over each step, which preserves its impulse; before its first knot it is 0."""
    if signal is None:
        return np.zeros(count)
    edges = begin + step * np.arange(count + 1)
    if signal.x[-1] > FAR / 2:
        found = np.empty((count, 1))
        held_means(signal.x[:-1, None], signal.c[-1][:, None], edges, np.zeros(1), found)
        return found[:, 0]
    first, last = float(signal.x[0]), float(signal.x[-1])
    inside = np.clip(edges, first, last)
    total = signal.antiderivative()(inside) + (edges - inside) * signal(inside)
    return np.diff(total) / step


def simulate(
    machine: Machine,
    times: Array,
    command: Mapping[str, PPoly] | None = None,
    forcing: Mapping[str, PPoly] | None = None,
    start: Start | tuple[Array, Array] | None = None,
    seed: int | None = None,
    worker: tuple[Any, Any] | None = None,
) -> JointTrajectory:
    """Simulate a machine and sample it.

    Parameters
    ----------
    times : (n,) stamps [s] of the measurements, increasing.
    command : by joint the input of its command path: a force, or the reference of a controller in the path.
    forcing : by joint a force that is added after the controller (feed-forward).
    start : positions of joints at the first step, or whole vectors (nq,), (nv,); by default the reference pose at rest.
    seed : of the noise; without one the output is deterministic.
    worker : model and data for the run, from `MujocoBody.worker`, with the machine's parameters.

    Raises InputError where the run diverges, the times do not increase, or a joint is unknown.
    """
    times = np.ascontiguousarray(times, dtype=float)
    if len(times) < 1 or np.any(np.diff(times) < 0.0) or not np.isfinite(times).all():
        raise InputError("simulation times must increase")
    physical = {joint: physical_times(model, times) for joint, model in machine.paths.items()}
    step = machine.body.step
    begin = begin_of(float(times[0]), min(float(one[0]) for one in physical.values()), step)
    count = math.ceil((float(times[-1]) - begin) / step - 1e-6) + 2
    _, rows = run_steps(machine, begin, count, command, forcing, start, worker)
    noise = [
        [] if seed is None else samplers(model, seed + place)
        for place, model in enumerate(machine.paths.values())
    ]
    return sampled(machine, times, np.column_stack(list(physical.values())), rows, 0, begin, noise)


def begin_of(first: float, earliest: float, step: float) -> float:
    """Start time [s] of a run: a whole number of steps before its first stamp, not after the oldest of the first
    measurements."""
    return first - step * max(math.ceil((first - earliest) / step - 1e-6), 0)


def sampled(
    machine: Machine,
    times: Array,
    physical: Array,
    rows: Array,
    first: int,
    begin: float,
    noise: Sequence[list],
    span: float = 0.0,
) -> JointTrajectory:
    """Measurements at stamps `times` (n,) of a run that begins at `begin` [s].

    `physical` (n, joints) are the times [s] at which measurements were taken, `rows` those of the steps from the
    number `first` on. `noise` has for each joint the operations on its samples. The effort is the mean over the
    `span` [s] before, or instantaneous for 0.
    """
    names, nq = machine.joints, machine.body.model.nq
    made = np.empty((len(COLUMNS), len(times), len(names)))
    rows, step = np.ascontiguousarray(rows), machine.body.step
    sample_joints(rows, first, begin, step, np.ascontiguousarray(physical), made)
    position, velocity, output, effort = made
    if span > 0.0:
        mean_efforts(rows, first, begin, step, span, np.ascontiguousarray(physical), effort)
    for place, joint in enumerate(names):
        if not any(t.element.slot == "sensor" and t.element.kernel for t in machine.paths[joint].terms):
            output[:, place] = position[:, place]
        for sample in noise[place]:
            output[:, place] = sample(times, output[:, place].copy())
    width = len(COLUMNS) * len(names)
    whole = np.empty((len(times), rows.shape[1] - width))
    sample_columns(rows, width, first, begin, step, times, whole)
    return JointTrajectory(
        times, names, position, velocity, effort, output, pose=whole[:, :nq], rate=whole[:, nq:]
    )


def run_steps(
    machine: Machine,
    begin: float,
    count: int,
    command: Mapping[str, PPoly] | None = None,
    forcing: Mapping[str, PPoly] | None = None,
    start: Start | tuple[Array, Array] | None = None,
    worker: tuple[Any, Any] | None = None,
) -> tuple[Array, Array]:
    """Times (count,) of the steps and the rows filled by `Stepping.run`. Arguments as for `simulate`."""
    stepping = compile_machine(machine)
    step = machine.body.step
    names = machine.joints
    for given in (command or {}, forcing or {}):
        for joint in given:
            if joint not in names:
                raise InputError(f"the joint {joint!r} has no path, so nothing drives it")
    commands = np.column_stack(
        [means(delayed_command(machine.paths[j], (command or {}).get(j)), begin, step, count) for j in names]
    )
    forcings = np.column_stack([means((forcing or {}).get(j), begin, step, count) for j in names])
    model, data = machine.body.worker() if worker is None else worker
    soft_constraint.put(model, machine.body.joints, machine.paths)
    pose, rate = _start(machine, start)
    data.qpos[:], data.qvel[:], data.time = pose, rate, begin
    data.qacc_warmstart[:] = 0.0
    places = [machine.body.joints[name] for name in names]
    rows = count * (len(COLUMNS) * len(names) + model.nq + model.nv + stepping.layout.pasts)
    if rows > AT_ONCE * 10:
        raise InputError(f"{count} steps are too many to simulate at once")
    out = np.empty((count, len(COLUMNS) * len(names) + model.nq + model.nv))
    done = stepping.run(
        model._address, data._address, data.qpos, data.qvel, data.qfrc_applied, model.dof_damping,
        np.array([one.position for one in places]), np.array([one.velocity for one in places]), begin, step,
        commands, forcings, vector_of(machine.paths, stepping.layout),
        start_states(machine.paths, machine.body.joints, stepping.layout, pose, rate, commands[0], forcings[0]),
        np.empty((count, stepping.layout.pasts)), out, 0, False,
    )  # fmt: skip
    if done < count:
        raise InputError(f"the simulation diverges at t = {begin + done * step:.4g} s; check the parameters")
    return begin + step * np.arange(count, dtype=np.float64), out


def vector_of(paths: Mapping[str, Model], layout: Layout) -> Array:
    """Parameter vector of paths with this structure."""
    known = {joint: model.parameters for joint, model in paths.items()}
    return np.array(
        [
            known[joint][name].value if name in known[joint] else default
            for joint, name, default in layout.parameters
        ],
        dtype=float,
    )


def start_states(
    paths: Mapping[str, Model],
    joints: Mapping[str, Joint],
    layout: Layout,
    pose: Array,
    rate: Array,
    command: NDArray,
    forcing: NDArray,
) -> Array:
    """The elements' own states at the start: those after a long time in the initial condition."""
    found: dict[tuple[str, str], float] = {}
    for place, (joint, model) in enumerate(paths.items()):
        own = joints[joint]
        x, v = float(pose[own.position]), float(rate[own.velocity])
        asked = float(command[place])
        for term in model.terms:
            element = term.element
            if not element.own or element.initial is None:
                continue
            borrowed = {n: model.borrowed(s, default) for n, (s, default) in element.borrows.items()}
            values = term.numbers | borrowed
            signal = (
                asked if element.slot == "command" else _effort(model, x, v, asked) + float(forcing[place])
            )
            for state, value in zip(element.own, element.initial(x, v, signal, **values)):
                found[joint, f"{term.label}.{state}"] = value
    return np.array([found.get(one, 0.0) for one in layout.states], dtype=float)


def _effort(model: Model, position: float, velocity: float, command: float) -> float:
    """Output of a controller in the path for this command; the command itself where there is none."""
    for term in model.terms:
        if term.element.acts == "feedback" and not term.element.own and term.element.kernel is not None:
            values = term.numbers
            return float(term.element.kernel(command, position, velocity, 0.0, **values))
    return command


def _start(machine: Machine, start: Start | tuple[Array, Array] | None) -> tuple[Array, Array]:
    if isinstance(start, tuple):
        return start
    return pose_of(machine, start or {}), np.zeros(machine.body.model.nv)
