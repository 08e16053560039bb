"""An experiment with a machine of several joints, and its run without ROS. Example of its file:

model: leg.yaml                  # for `rhythmid run`; `rhythmid simulate` names it
duration: 20                     # s
rate: 500                        # Hz, of commands and measurements
seed: 0
namespace: /leg
start: {rail: 0.42}              # positions of joints; those of driven joints start where their excitation does
orthogonal: true                 # the joints' multisines use disjoint sets of spectral lines
excitation:                      # by joint: a reference where a controller is in the path, else a force
  hip:  {offset: 0.6, limits: [-0.5, 1.5], type: multisine, …}
  knee: {offset: -1.2}           # held
time: {mode: lockstep}           # of `rhythmid run`, with window and layout as in an experiment of one axis
safety: {ramp: 0.5, command_timeout: 0.1, joints: {knee: {envelope: [-2.4, -0.3], max_speed: 15}}}
record: {path: bag}
"""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, ConfigDict, TypeAdapter
from pydantic import Field as Limits

from rhythmid.body.machine import Machine
from rhythmid.document import Node, parse, read
from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Excitation
from rhythmid.excitation.sequence import build
from rhythmid.experiment import NodeSpec, of_topic
from rhythmid.plain_yaml import plain_yaml
from rhythmid.settings import Delay, TimeMode
from rhythmid.validation import Number, Range, Whole, validated

if TYPE_CHECKING:
    from rhythmid.body.joint_plant import JointPlant

Array = NDArray[np.float64]
MOST_RUN_SAMPLES = 10_000_000  # largest number of samples in a run
AT_ONCE = 10_000  # samples that are simulated together
TOPICS = ("command", "joint_states")


@dataclass(frozen=True)
class JointExcitation:
    """The command of one joint: an offset and an excitation about it, within limits."""

    offset: float = 0.0
    limits: tuple[float, float] = (-math.inf, math.inf)
    excitation: Excitation | None = None

    def __call__(self, time: Array, share: Array | float = 1.0) -> Array:
        """Commands at times (n,) [s], with the excitation scaled by `share`."""
        value = np.full(len(time), self.offset)
        if self.excitation is not None:
            value = value + share * self.excitation(time)
        return np.clip(value, *self.limits)


@dataclass(frozen=True)
class JointWatch:
    """Real-time limits of a joint's measurements: a range of positions and a speed."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    envelope: Range = (-math.inf, math.inf)
    max_speed: Annotated[float, Limits(ge=0)] = math.inf


@dataclass(frozen=True)
class JointSafety:
    """Limits of a run: those of one axis, see `rhythmid.settings.Safety`, and those of each joint by its name.

    Commands never leave the `limits` of a joint's excitation. A reference that is not renewed is held; a force
    fades to zero.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")
    ramp: Annotated[Number, Limits(ge=0)] = 0.0
    stale_after: Annotated[Number, Limits(ge=1e-3)] = 0.5
    frozen_after: Annotated[Number, Limits(ge=0)] = 0.0
    max_gap: Annotated[Number, Limits(ge=0)] = 0.0
    command_timeout: Annotated[Number, Limits(ge=0)] = 0.1
    joints: dict[str, JointWatch] = field(default_factory=dict)


@dataclass(frozen=True)
class JointRecording:
    """Destination and format of a recording."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    path: Path = Path("bag")
    storage: Literal["mcap", "sqlite3"] = "mcap"
    topics: tuple[str, ...] = (*TOPICS, "run")


@dataclass(frozen=True)
class JointExperiment:
    """Content of an experiment's file."""

    duration: float
    rate: float
    excitation: Mapping[str, JointExcitation]
    start: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    namespace: str = "/machine"
    model: Path | None = None
    time: TimeMode = TimeMode()
    safety: JointSafety = JointSafety()
    record: JointRecording = JointRecording()
    path: Path = Path("experiment.yaml")

    @classmethod
    def load(cls, path: str | Path) -> "JointExperiment":
        """The experiment in a YAML file. Raises InputError with the line and key of an error."""
        return _experiment(read(path), Path(path).resolve())

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "JointExperiment":
        """The experiment with the content of a file. Raises InputError with the key of an error."""
        path = Path("experiment")
        return _experiment(parse(plain_yaml(content, path.name), path.name), path)

    input_delay = measurement_delay = Delay()  # no delays by nodes: the joints' paths contain them

    def with_record(self, **changes: Any) -> "JointExperiment":
        """A copy with other recording settings."""
        return replace(self, record=replace(self.record, **changes))

    def nodes(self) -> list[NodeSpec]:
        """The nodes of this experiment: excitation, plant, recorder. Raises InputError where it names no model."""
        from rhythmid.body.joint_graph import joint_nodes

        return joint_nodes(self)

    @property
    def count(self) -> int:
        """Number of samples per topic. Raises InputError where there are too few or too many."""
        count = round(self.duration * self.rate)
        if not 1 < count <= MOST_RUN_SAMPLES:
            raise InputError(f"a run has 2 to {MOST_RUN_SAMPLES} samples, not {count}")
        return count

    @property
    def period_ns(self) -> int:
        """Sample period [ns]."""
        return round(1e9 / self.rate)

    def asked(self, machine: Machine) -> Array:
        """Commands (n, joints), in the order of the machine's joints, faded in and out about the offsets. Raises
        InputError for a joint without a path."""
        for joint in self.excitation:
            if joint not in machine.joints:
                raise InputError(
                    f"excitation: the joint {joint!r} has no path; the model's are {', '.join(machine.joints)}"
                )
        time = np.arange(self.count, dtype=np.int64) * self.period_ns * np.float64(1e-9)
        end, ramp = self.count * self.period_ns * 1e-9, self.safety.ramp
        share = np.clip(np.minimum(time, end - time) / ramp, 0.0, 1.0) if ramp > 0.0 else 1.0
        return np.column_stack(
            [self.excitation.get(joint, JointExcitation())(time, share) for joint in machine.joints]
        )

    def plant(self, machine: Machine) -> "JointPlant":
        """The machine at the experiment's start."""
        from rhythmid.body.joint_plant import JointPlant  # the compiler that it needs is slow to load

        first = dict(zip(machine.joints, self.asked(machine)[0].tolist()))
        driven = {joint: value for joint, value in first.items() if machine.controlled(joint)}
        return JointPlant(machine, self.period_ns, self.seed, {**driven, **self.start})


@dataclass(frozen=True)
class JointMessages:
    """Content of a run's topics: stamps int64[n] [ns], and for each topic the joints and columns (n, joints) by field."""

    stamp_ns: NDArray[np.int64]
    topics: Mapping[str, tuple[tuple[str, ...], Mapping[str, Array]]]


def perform(machine: Machine, experiment: JointExperiment) -> JointMessages:
    """Run an experiment; the messages equal those of the ROS graph in lockstep mode.

    Raises InputError for a joint without a path, or a run that is too long or diverges.
    """
    asked, plant = experiment.asked(machine), experiment.plant(machine)
    stamps = np.arange(experiment.count, dtype=np.int64) * experiment.period_ns
    parts: list[dict[str, Array]] = []
    for first in range(0, len(stamps), AT_ONCE):
        chosen = slice(first, first + AT_ONCE)
        plant.push_many(stamps[chosen], asked[chosen])
        parts.append(plant.states(int(stamps[chosen][-1]))[1])
    states = {name: np.vstack([part[name] for part in parts]) for name in parts[0]}
    topics = {
        f"{experiment.namespace}/command": (machine.joints, {command_field(machine): asked}),
        f"{experiment.namespace}/joint_states": (plant.measured, states),
    }
    return JointMessages(stamps, topics)


def command_field(machine: Machine) -> str:
    """The field of a command message: position for references, effort for forces."""
    return "position" if any(machine.controlled(joint) for joint in machine.joints) else "effort"


@dataclass(frozen=True)
class _Excitation:
    """The command of a joint as written in the file; further keys depend on its type."""

    offset: Number = 0.0
    limits: Range = (-math.inf, math.inf)


@dataclass(frozen=True)
class _Time:
    """Timing of a run as written in the file."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    mode: Literal["lockstep", "realtime"] = "lockstep"
    window: Annotated[Whole, Limits(ge=1, le=100)] = 100
    layout: Literal["composed", "processes"] = "composed"


@dataclass(frozen=True)
class _Experiment:
    """An experiment as written in the file."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    duration: Annotated[Number, Limits(ge=1e-6, le=1e6)]
    excitation: dict[str, dict[str, Any]]
    model: str | None = None
    rate: Annotated[Number, Limits(ge=1.0, le=1e5)] = 1000.0
    start: dict[str, Number] = field(default_factory=dict)
    seed: Annotated[Whole, Limits(ge=0, le=2**31 - 1)] = 0
    namespace: Annotated[str, AfterValidator(of_topic)] = "/machine"
    orthogonal: bool = False
    time: _Time = _Time()
    safety: JointSafety = JointSafety()
    record: JointRecording = JointRecording()


_WRITTEN: TypeAdapter[_Experiment] = TypeAdapter(_Experiment)
_ABOUT: TypeAdapter[_Excitation] = TypeAdapter(_Excitation)


def _experiment(document: Node, path: Path) -> JointExperiment:
    given = validated(document, _WRITTEN)
    entries = document.at("excitation").mapping()
    shared = [j for j, node in entries.items() if given.orthogonal and _kind(node) == "multisine"]
    excitation = {
        joint: _excitation(node, path.parent, (shared.index(joint), len(shared)) if joint in shared else None)
        for joint, node in entries.items()
    }
    model = None if given.model is None else path.parent / given.model
    if model is not None and not os.path.isfile(model):
        document.at("model").fail(f"no such file: {model}")
    time = TimeMode(given.time.mode, round(given.rate), given.time.window, given.time.layout)
    return JointExperiment(
        given.duration, given.rate, excitation, given.start, given.seed, given.namespace, model, time, given.safety,
        given.record, path,
    )  # fmt: skip


def _kind(node: Node) -> Any:
    return node.mapping().get("type", replace(node, value=None)).value


def _excitation(node: Node, folder: Path, part: tuple[int, int] | None) -> JointExcitation:
    keys = node.mapping()
    own = {name: one for name, one in keys.items() if name in ("offset", "limits")}
    about = validated(replace(node, value=own), _ABOUT)
    plain = {name: one.plain for name, one in keys.items() if name not in own}
    if not plain:
        return JointExcitation(about.offset, about.limits)
    if part is not None:
        plain = {"part": list(part), **plain}
    try:
        return JointExcitation(about.offset, about.limits, build(plain, folder))
    except InputError as error:
        raise InputError(f"{node.place}: {node.path}: {error}") from None
