"""An experiment with a machine of several joints, and its run without ROS.

duration: 20                     # s
rate: 500                        # Hz, of commands and measurements
seed: 0
namespace: /leg
start: {rail: 0.42}              # positions of joints; the others begin at the reference pose
excitation:                      # by joint: a reference where a controller is in the path, else a force
  hip:  {offset: 0.6, limits: [-0.5, 1.5], type: multisine, …}
  knee: {offset: -1.2}           # held
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.machine import Machine
from rhythmid.body.simulate import simulate
from rhythmid.document import Node, read
from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Excitation
from rhythmid.excitation.sequence import build
from rhythmid.simulation.signal import zero_order_hold

Array = NDArray[np.float64]
LONGEST = 10_000_000  # samples of a run


@dataclass(frozen=True)
class JointExcitation:
    """What one joint is commanded: an offset and an excitation about it, within limits."""

    offset: float = 0.0
    limits: tuple[float, float] = (-math.inf, math.inf)
    excitation: Excitation | None = None

    def __call__(self, time: Array) -> Array:
        value = np.full(len(time), self.offset)
        if self.excitation is not None:
            value = value + self.excitation(time)
        return np.clip(value, *self.limits)


@dataclass(frozen=True)
class JointExperiment:
    """Contents of an experiment's file."""

    duration: float
    rate: float
    excitation: Mapping[str, JointExcitation]
    start: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    namespace: str = "/machine"

    @classmethod
    def load(cls, path: str | Path) -> "JointExperiment":
        """The experiment in a YAML file. Raises InputError naming the line and key of what is wrong."""
        return _experiment(read(path), Path(path).resolve().parent)


@dataclass(frozen=True)
class JointMessages:
    """What a run's topics carry: stamps int64[n] [ns], and for each topic the joints and columns (n, joints) by field."""

    stamp_ns: NDArray[np.int64]
    topics: Mapping[str, tuple[tuple[str, ...], Mapping[str, Array]]]


def perform(machine: Machine, experiment: JointExperiment) -> JointMessages:
    """Run an experiment. Raises InputError for a joint that has no path, a run that is too long or that diverges."""
    for joint in experiment.excitation:
        if joint not in machine.joints:
            raise InputError(
                f"excitation: the joint {joint!r} has no path; the model's are {', '.join(machine.joints)}"
            )
    count = round(experiment.duration * experiment.rate)
    if not 1 < count <= LONGEST:
        raise InputError(f"a run has 2 to {LONGEST} samples, not {count}")
    stamps = np.round(np.arange(count) * 1e9 / experiment.rate).astype(np.int64)
    time = (stamps * 1e-9).astype(np.float64)
    asked = {joint: experiment.excitation.get(joint, JointExcitation())(time) for joint in machine.joints}
    command = {joint: zero_order_hold(time, values) for joint, values in asked.items()}
    start = {**{joint: float(values[0]) for joint, values in asked.items()}, **experiment.start}
    run = simulate(machine, time, command, start=start, seed=experiment.seed)
    whole = np.column_stack([asked[joint] for joint in machine.joints])
    states: dict[str, Array] = {"position": run.output, "velocity": run.velocity, "effort": run.effort}
    joints = machine.joints
    if (base := machine.body.joints.get(machine.body.base)) is not None:
        joints = (*joints, base.name)
        further = run.pose[:, base.position], run.rate[:, base.velocity], np.zeros(count)
        states = {name: np.column_stack([one, more]) for (name, one), more in zip(states.items(), further)}
    controlled = any(t.element.acts == "feedback" for model in machine.paths.values() for t in model.terms)
    topics = {
        f"{experiment.namespace}/command": (machine.joints, {"position" if controlled else "effort": whole}),
        f"{experiment.namespace}/joint_states": (joints, states),
    }
    return JointMessages(stamps, topics)


def _experiment(document: Node, folder: Path) -> JointExperiment:
    keys = document.mapping(["duration", "rate", "excitation", "start", "seed", "namespace"])
    for name in ("duration", "excitation"):
        if name not in keys:
            document.fail(f"'{name}:' is missing")
    start = {} if "start" not in keys else {n: one.number() for n, one in keys["start"].mapping().items()}
    return JointExperiment(
        keys["duration"].number(1e-6, 1e6),
        keys["rate"].number(1.0, 1e5) if "rate" in keys else 1000.0,
        {joint: _excitation(node, folder) for joint, node in keys["excitation"].mapping().items()},
        start,
        keys["seed"].whole(0, 2**31 - 1) if "seed" in keys else 0,
        "/" + keys["namespace"].text().strip("/") if "namespace" in keys else "/machine",
    )


def _excitation(node: Node, folder: Path) -> JointExcitation:
    keys = node.mapping()
    offset = keys["offset"].number() if "offset" in keys else 0.0
    limits = (-math.inf, math.inf)
    if "limits" in keys:
        ends = [end.number(finite=False) for end in keys["limits"].items()]
        if len(ends) != 2 or not ends[0] < ends[1]:
            keys["limits"].fail("two positions [low, high] are expected, low < high")
        limits = ends[0], ends[1]
    spec: dict[str, Any] = {n: one.plain for n, one in keys.items() if n not in ("offset", "limits")}
    if not spec:
        return JointExcitation(offset, limits)
    try:
        return JointExcitation(offset, limits, build(spec, folder))
    except InputError as error:
        raise InputError(f"{node.place}: {node.path}: {error}") from None
