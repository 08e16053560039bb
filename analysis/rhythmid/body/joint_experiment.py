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
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, TypeAdapter
from pydantic import Field as Limits

from rhythmid.body.machine import Machine
from rhythmid.body.simulate import simulate
from rhythmid.document import Node, read
from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Excitation
from rhythmid.excitation.sequence import build
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.validation import Number, Range, Whole, validated

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


@dataclass(frozen=True)
class _Excitation:
    """What a joint is commanded, as it is written; the rest says of what kind it is."""

    offset: Number = 0.0
    limits: Range = (-math.inf, math.inf)


@dataclass(frozen=True)
class _Experiment:
    """An experiment as it is written."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    duration: Annotated[Number, Limits(ge=1e-6, le=1e6)]
    excitation: dict[str, dict[str, Any]]
    rate: Annotated[Number, Limits(ge=1.0, le=1e5)] = 1000.0
    start: dict[str, Number] = field(default_factory=dict)
    seed: Annotated[Whole, Limits(ge=0, le=2**31 - 1)] = 0
    namespace: str = "/machine"


_WRITTEN: TypeAdapter[_Experiment] = TypeAdapter(_Experiment)
_ABOUT: TypeAdapter[_Excitation] = TypeAdapter(_Excitation)


def _experiment(document: Node, folder: Path) -> JointExperiment:
    given = validated(document, _WRITTEN)
    excitation = {
        joint: _excitation(node, folder) for joint, node in document.at("excitation").mapping().items()
    }
    name = "/" + given.namespace.strip("/")
    return JointExperiment(given.duration, given.rate, excitation, given.start, given.seed, name)


def _excitation(node: Node, folder: Path) -> JointExcitation:
    keys = node.mapping()
    own = {name: one for name, one in keys.items() if name in ("offset", "limits")}
    about = validated(replace(node, value=own), _ABOUT)
    spec = {name: one for name, one in keys.items() if name not in own}
    if not spec:
        return JointExcitation(about.offset, about.limits)
    plain = {name: one.plain for name, one in spec.items()}
    try:
        return JointExcitation(about.offset, about.limits, build(plain, folder))
    except InputError as error:
        raise InputError(f"{node.place}: {node.path}: {error}") from None
