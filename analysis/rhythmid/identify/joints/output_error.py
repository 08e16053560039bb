"""Free runs of a machine with several joints over the stretches of its records: prediction error, and refinement of
parameters.

A stretch begins where contact ends, at the measured pose and rates. From there the commands alone drive the
machine. With a fixed base the limbs do not affect one another, so one run gives the derivative with respect to one
parameter of every limb.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly
from scipy.optimize import least_squares

from rhythmid.body.body import BODY
from rhythmid.body.machine import FIXED, Machine
from rhythmid.body.simulate import run_steps
from rhythmid.errors import InputError
from rhythmid.identify.drive import controlled
from rhythmid.identify.joints.body_motion import BodyMotion
from rhythmid.identify.joints.correlation import Correlations
from rhythmid.identify.joints.joint_motion import JointBalances
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel
from rhythmid.simulation.signal import Hold, continuous

Array = NDArray[np.float64]
DIFFERENCE = 1e-3  # finite-difference step, relative to a parameter's standard deviation
BEFORE = 1.0  # [s] time before the record during which a command has its first value; longer than any delay
DIVERGED = 10.0  # error, as a multiple of the motion, that is assigned to a diverging run
TRIALS = 8  # largest number of simulations of all stretches with changed parameters


@dataclass(frozen=True)
class FreeRuns:
    """Free-run error (rms) of each joint as a share of its motion's standard deviation; the number of `stretches`,
    the number of runs that `diverged`, and the first of these in words."""

    nrmse: dict[str, float]
    stretches: int
    diverged: int
    first: str = ""

    def told(self, name: str) -> tuple[str, ...]:
        """One line that runs with the values called `name` diverge; empty where none does."""
        if not self.diverged:
            return ()
        runs = f"{self.diverged} of {self.stretches} free runs" if self.stretches > 1 else "the free run"
        return (
            f"{runs} with the {name} values: {self.first}; counted there as {100.0 * DIVERGED:.0f} % of the motion",
        )


@dataclass(frozen=True)
class Knowledge:
    """Prior of a parameter before the free runs: normal, within bounds."""

    mean: float
    std: float
    low: float
    high: float


def commands(machine: Machine, record: JointRecord) -> tuple[dict[str, PPoly], dict[str, PPoly]]:
    """The signal that drives each joint, and the feed-forward of its controller. Raises InputError where a driven
    joint has neither."""
    drives: dict[str, PPoly] = {}
    forward: dict[str, PPoly] = {}
    for joint in machine.joints:
        one = record.joints[joint]
        closed = controlled(machine.paths[joint])
        given = one.reference or (one.input if (one.input_kind == "reference") == closed else None)
        if closed and given is None:
            raise InputError(f"{record.name}: the controller of {joint} has no recorded reference to run by")
        if not closed and given is None:
            given = one.effort
        if given is not None:
            drives[joint] = _signal(given, "zero" if closed else one.hold)
        if closed and one.forcing is not None:
            forward[joint] = _signal(one.forcing, "linear")
    return drives, forward


def _signal(channel: Channel, hold: Hold) -> PPoly:
    """A channel as a signal that had its first value before the record began, so that delayed signals start with
    it, too."""
    time = np.concatenate([[channel.time[0] - BEFORE], channel.time])
    return continuous(time, np.concatenate([channel.value[:1], channel.value]), hold)


def errors_of(machine: Machine, balances: JointBalances, records: Sequence[JointRecord]) -> Array:
    """Errors (n, joints) of free runs over all stretches, each as a share of its joint's motion."""
    return np.concatenate([errors for errors, _ in _runs(machine, balances, records)])


def _runs(
    machine: Machine, balances: JointBalances, records: Sequence[JointRecord]
) -> list[tuple[Array, str]]:
    """For each stretch the free-run errors (n, joints) as shares of the joints' motion, and in words why it diverged."""
    sizes = _sizes(balances, machine)
    drives = [commands(machine, record) for record in records]
    worker = machine.body.worker()
    found: list[tuple[Array, str]] = []
    for body in balances.bodies:
        measured = _measured(machine, body)
        try:
            made = _run(machine, body, *drives[body.stretch.record], worker)
            errors = (made - measured) / sizes
            found.append((np.clip(errors, -DIVERGED, DIVERGED), _astray(machine, body, errors)))
        except InputError as error:
            found.append((np.full(measured.shape, DIVERGED), str(error)))
    return found


def _astray(machine: Machine, body: BodyMotion, errors: Array) -> str:
    """In words, where the errors (n, joints) of a run first reach the value of a diverging run; empty where they do
    not."""
    far = np.abs(errors) >= DIVERGED
    if not far.any():
        return ""
    first = int(np.argmax(far.any(axis=1)))
    joint = machine.joints[int(np.argmax(far[first]))]
    return f"the simulation is off by more than {DIVERGED:g} times the motion of {joint} from t = {body.stretch.time[first]:.4g} s on"


def free_runs(machine: Machine, balances: JointBalances, records: Sequence[JointRecord]) -> FreeRuns:
    """Prediction error of the machine for these records' motion."""
    made = _runs(machine, balances, records)
    errors = np.sqrt(np.mean(np.concatenate([one for one, _ in made]) ** 2, axis=0))
    reasons = [reason for _, reason in made if reason]
    return FreeRuns(
        dict(zip(machine.joints, errors.tolist(), strict=True)), len(made), len(reasons), *reasons[:1]
    )


def refine(
    machine: Machine,
    balances: JointBalances,
    records: Sequence[JointRecord],
    known: Mapping[str, Knowledge],
    noise: float,
) -> tuple[Machine, dict[str, float], Correlations]:
    """The machine whose named parameters fit the free runs, with their standard deviations and correlations.

    `noise` is the expected free-run error of a correct model, as a share of the motion. It weights the runs against
    the prior `known`.
    """
    names = list(known)
    mean, std, low, high = (
        np.array([getattr(known[n], side) for n in names]) for side in ("mean", "std", "low", "high")
    )
    groups = _together(machine, names)

    def moved(value: Array) -> Machine:
        return machine.with_values(dict(zip(names, np.clip(value, low, high).tolist(), strict=True)))

    def residual(scaled: Array) -> Array:
        errors = errors_of(moved(mean + std * scaled), balances, records)
        return np.concatenate([errors.ravel() / (noise * np.sqrt(_repeats(balances))), scaled])

    def jacobian(scaled: Array) -> Array:
        base = residual(scaled)
        count = len(base) - len(names)
        made = np.zeros((len(base), len(names)))
        for group in groups:
            step = np.zeros(len(names))
            for place, _ in group:
                up = mean[place] + std[place] * (scaled[place] + DIFFERENCE) <= high[place]
                step[place] = DIFFERENCE if up else -DIFFERENCE
            change = (residual(scaled + step) - base)[:count].reshape(-1, len(machine.joints))
            for place, joints in group:
                own = np.zeros_like(change)
                own[:, joints] = change[:, joints] / step[place]
                made[:count, place] = own.ravel()
        made[count:] = np.eye(len(names))
        return made

    start = np.array([machine.value(name) for name in names])
    ends = (low - mean) / std - 1e-9, (high - mean) / std + 1e-9
    solve: Any = least_squares
    found = solve(
        residual, np.clip((start - mean) / std, *ends), jacobian, bounds=ends, max_nfev=TRIALS, loss="linear"
    )
    covariance = np.asarray(np.linalg.inv(found.jac.T @ found.jac), dtype=np.float64)
    spread = dict(zip(names, (np.sqrt(np.diag(covariance)) * std).tolist(), strict=True))
    return moved(mean + std * found.x), spread, Correlations.of_covariance(names, covariance)


def _repeats(balances: JointBalances) -> float:
    """Samples in a quarter of the motion's strongest period: about the correlation time of free-run errors."""
    return max(0.25 / (balances.dominant * balances.bodies[0].stretch.period), 1.0)


def _together(machine: Machine, names: Sequence[str]) -> list[list[tuple[int, list[int]]]]:
    """Groups of parameters of different limbs, each with its index and the indices of the joints that it affects."""
    limb = {joint: _limb(machine, joint) for joint in machine.joints}
    joints = {one: [k for k, j in enumerate(machine.joints) if limb[j] == one] for one in set(limb.values())}
    waiting: dict[int, list[tuple[int, list[int]]]] = {one: [] for one in joints}
    for place, name in enumerate(names):
        owner = (
            name.removeprefix(f"{BODY}.").rpartition(".")[0]
            if name.startswith(f"{BODY}.")
            else name.split(".")[0]
        )
        joint = owner if owner in limb else machine.body.joint_of(owner)
        waiting[limb[joint]].append((place, joints[limb[joint]]))
    most = max((len(one) for one in waiting.values()), default=0)
    return [[one[k] for one in waiting.values() if k < len(one)] for k in range(most)]


def _limb(machine: Machine, joint: str) -> int:
    """Number of the link next to a fixed base on the path from a joint; one number for all joints where the base
    moves."""
    if machine.body.base != FIXED:
        return 0
    model = machine.body.model
    number = int(model.jnt_bodyid[model.joint(joint).id])
    while model.body_weldid[model.body_parentid[number]] != 0:
        number = int(model.body_parentid[number])
    return number


def _measured(machine: Machine, body: BodyMotion) -> Array:
    return body.stretch.pose[:, [machine.body.joints[joint].position for joint in machine.joints]]


def _sizes(balances: JointBalances, machine: Machine) -> Array:
    return np.std(np.concatenate([_measured(machine, body) for body in balances.bodies]), axis=0)


def _run(
    machine: Machine, body: BodyMotion, drives: Mapping[str, PPoly], forward: Mapping[str, PPoly], worker
) -> Array:
    """Positions (n, joints) of a free run at the samples of a stretch."""
    time, step = body.stretch.time, machine.body.step
    count = int(np.ceil((time[-1] - time[0]) / step)) + 2
    start = np.ascontiguousarray(body.pose[0]), np.ascontiguousarray(body.rate[0])
    grid, rows = run_steps(machine, float(time[0]), count, drives, forward, start, worker)
    places = range(0, 4 * len(machine.joints), 4)
    return np.column_stack([np.interp(time, grid, rows[:, place + 2]) for place in places])
