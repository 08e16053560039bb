"""One file describes a run: machine, excitation, delays, noise, time mode, what is recorded and where.

`rhythmid simulate`, `rhythmid run` and the launch file read the same experiment.yaml. Only `Experiment.nodes` turns it
into nodes with parameters; `perform` is the same run without ROS.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, TypeAdapter

from rhythmid.document import Node, parse, read
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Excitation
from rhythmid.excitation.sequence import IN_FOLDER, AnyExcitation
from rhythmid.model import Model
from rhythmid.settings import KEYS, Delay, Forcing, Noise, Recording, Safety, TimeMode
from rhythmid.unstated_forcing import NO_FORCING, assumed_note, resolved_forcing
from rhythmid.validation import ByShape, InKeys, Number, Plain, Whole, validated

LONGEST_DELAY = 10.0  # [s]; a longer one was probably given in another unit
LONGEST_RUN = 50_000_000  # samples of an offline run: 14 hours at 1 kHz, a few gigabytes


@dataclass(frozen=True)
class NodeSpec:
    """A node of the graph: its package, executable, name, parameters and remappings."""

    package: str
    executable: str
    name: str
    parameters: Mapping[str, Any]
    remappings: Mapping[str, str] = field(default_factory=dict)


def plant_model(model: Model, forcing: Forcing, noise: Noise, catalogue: Catalogue | None = None) -> Model:
    """The model that the plant runs: with forcing and noise of the experiment added."""
    known = load_catalogue() if catalogue is None else catalogue
    if forcing.amplitude != 0.0 and not any(term.element.acts == "drive" for term in model.terms):
        values = {"amplitude": forcing.amplitude, "frequency": forcing.frequency, "phase": forcing.phase}
        model = model.with_element(known["periodic_forcing"], values, fixed=True)
    if noise.measurement_std > 0.0:
        values = {"std": noise.measurement_std, "correlation": noise.correlation}
        model = model.with_element(known["measurement_noise"], values, fixed=True)
    if noise.quantisation > 0.0:
        model = model.with_element(
            known["sensor_quantisation"], {"resolution": noise.quantisation}, fixed=True
        )
    return model


@dataclass(frozen=True)
class Experiment:
    """A run, completely described.

    Attributes
    ----------
    model, model_path
        The machine, and the file that it was read from.
    excitation, excitation_spec
        The command over time, and how the file describes it.
    forcing
        Forcing generated on the machine: amplitude [N], frequency [Hz], phase [rad].
    forcing_assumed
        Whether neither experiment nor model states the forcing, and one acts; see `unstated_forcing`.
    input_delay, measurement_delay
        Of command and measurement [s], or profiles of them.
    noise
        Of the measurement: standard deviation [m or rad], colour, quantisation.
    time
        Real time or lockstep, rate [Hz], layout of the nodes.
    duration
        Of the run [s].
    seed
        Of noise and random excitations.
    initial
        Position and velocity at the start; None begins on the limit cycle.
    safety
        Limits of effort, position and speed.
    record
        The bag, and which topics it holds.
    namespace, joint
        Namespace and joint name of the topics.
    folder
        Folder to which relative paths refer.
    elements
        Folders with the user's own elements.

    Examples
    --------
    `Experiment.load` reads a file. Functions that take an experiment also accept a mapping.

    >>> import rhythmid as rh
    >>> run = rh.simulate(rh.paper_hopper(), {"excitation": {"type": "chirp", "amplitude": 0.01, "sweep": 2.0}})
    >>> run.experiment.duration, run.experiment.count
    (2.0, 2000)
    """

    model: Model
    model_path: Path
    excitation: Excitation
    excitation_spec: Mapping[str, Any]
    forcing: Forcing = Forcing()
    input_delay: Delay = Delay()
    measurement_delay: Delay = Delay()
    noise: Noise = Noise()
    time: TimeMode = TimeMode()
    duration: float = 0.0
    seed: int = 0
    initial: tuple[float, float] | None = None
    safety: Safety = Safety()
    record: Recording = Recording()
    namespace: str = "/hopper"
    joint: str = "leg"
    folder: Path = Path(".")
    elements: tuple[Path, ...] = ()
    forcing_assumed: bool = False

    @classmethod
    def load(
        cls, path: str | Path, elements: tuple[Path, ...] = (), model: str | Path | None = None
    ) -> "Experiment":
        """The experiment in a YAML file; paths in it are relative to it, except the bag's, which is relative to
        where the command is run. `model` is a model file that replaces the one named there. Raises InputError
        naming the line and key of what is wrong."""
        return _experiment(read(path), Path(path).resolve().parent, elements, model)

    @classmethod
    def from_text(cls, text: str, folder: str | Path = ".") -> "Experiment":
        """The experiment in a YAML text whose relative paths refer to `folder`."""
        return _experiment(parse(text, "experiment"), Path(folder).resolve(), ())

    @property
    def count(self) -> int:
        """Number of samples N of every topic."""
        return max(1, round(self.duration * 1e9 / self.time.period_ns))

    @property
    def plant_model(self) -> Model:
        """The model with forcing and noise, as the plant runs it."""
        return plant_model(self.model, self.forcing, self.noise, load_catalogue(self.elements))

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user, one line each."""
        return (assumed_note(self.forcing),) if self.forcing_assumed else ()

    @property
    def as_stated(self) -> "Experiment":
        """The run of a machine of one's own, on which only a stated forcing acts."""
        return replace(self, forcing=NO_FORCING, forcing_assumed=False) if self.forcing_assumed else self

    def with_record(self, **changes: Any) -> "Experiment":
        """A copy with other settings of the recording."""
        return replace(self, record=replace(self.record, **changes))

    def description(self) -> dict[str, Any]:
        """Content of the topic `run`: the experiment as run, without model, delays and noise, because these are to be identified."""
        return {
            "program": "rhythmid",
            "excitation": dict(self.excitation_spec),
            "forcing": {
                "amplitude": self.forcing.amplitude,
                "frequency": self.forcing.frequency,
                "phase": self.forcing.phase,
            },
            "forcing_assumed": self.forcing_assumed,
            "rate": self.time.rate,
            "time": self.time.mode,
            "duration": self.count * self.time.period_ns * 1e-9,
            "namespace": self.namespace,
            "joint": self.joint,
            "hold": "zero",
        }

    def nodes(self) -> list[NodeSpec]:
        """The graph of this experiment: excitation, two delay injectors, plant, recorder."""
        run = {
            "time_mode": self.time.mode,
            "rate": self.time.rate,
            "window": self.time.window,
            "count": self.count,
        }
        streams = [topic for topic in self.record.topics if topic not in ("run", "diagnostics")]
        # last consumer of the path, for which the credit of lockstep waits
        sinks = ["recorder"] if streams else []

        def injector(name: str, source: str, target: str, delay: Delay) -> NodeSpec:
            return NodeSpec(
                "rhythmid_nodes", "delay_injector", name,
                {
                    "time_mode": self.time.mode,
                    "rate": self.time.rate,
                    "delay": delay.constant,
                    "profile": str(delay.profile or ""),
                    "stamp_mode": "arrival",
                },
                {"input": source, "output": target},
            )  # fmt: skip

        low, high = self.safety.envelope
        return [
            NodeSpec(
                "rhythmid_nodes", "plant", "plant",
                {
                    **run,
                    "joint": self.joint,
                    "model": str(self.model_path),
                    "elements": [str(folder) for folder in self.elements],
                    "forcing_amplitude": self.forcing.amplitude,
                    "forcing_frequency": self.forcing.frequency,
                    "forcing_phase": self.forcing.phase,
                    "noise_std": self.noise.measurement_std,
                    "noise_correlation": self.noise.correlation,
                    "quantisation": self.noise.quantisation,
                    "seed": self.seed,
                    "initial": [] if self.initial is None else list(self.initial),
                    "consumers": sinks,
                    "max_effort": self.safety.max_effort,
                    "command_timeout": self.safety.command_timeout,
                },
            ),
            injector("command_delay", "excitation", "command", self.input_delay),
            injector("measurement_delay", "plant/joint_states", "joint_states", self.measurement_delay),
            NodeSpec(
                "rhythmid_nodes", "excitation", "excitation",
                {
                    **run,
                    "joint": self.joint,
                    "excitation": _json(self.excitation_spec),
                    "folder": str(self.folder),
                    "max_effort": self.safety.max_effort,
                    "ramp": self.safety.ramp,
                    "stale_after": self.safety.stale_after,
                    "envelope": [low, high],
                    "max_speed": self.safety.max_speed,
                    "position_unit": self.model.units.position,
                    "frozen_after": self.safety.frozen_after,
                    "max_gap": self.safety.max_gap,
                    "run": _json(self.description()),
                    "subscribers": 1 + ("excitation" in self.record.topics),
                    "consumers": ["plant", *sinks],
                },
            ),
            NodeSpec(
                "rhythmid_nodes", "recorder", "recorder",
                {
                    **run,
                    "path": str(self.record.path),
                    "storage": self.record.storage,
                    "topics": list(self.record.topics),
                },
                {"diagnostics": "/diagnostics"},
            ),
        ]  # fmt: skip


def _json(value: Any) -> str:
    import json

    return json.dumps(value, default=str)


def ramped(
    excitation: Excitation, safety: Safety, time: NDArray[np.float64], duration: float
) -> NDArray[np.float64]:
    """Excitation [N] at times [s] since its start, faded in and out over the ramp and clamped to the largest effort."""
    value = excitation(time)
    if safety.ramp > 0.0:
        value = value * np.clip(np.minimum(time, duration - time) / safety.ramp, 0.0, 1.0)
    return np.clip(value, -safety.max_effort, safety.max_effort)


def _of_seconds(value: float) -> float:
    if not 0.0 <= value <= LONGEST_DELAY:
        raise ValueError(
            f"{value:g} s is outside [0, {LONGEST_DELAY:g}]; a delay is in seconds and cannot be negative"
        )
    return value


def _settled(word: str) -> str:
    if word != "limit_cycle":
        raise ValueError("limit_cycle or {position: …, velocity: …} is expected")
    return word


def of_topic(namespace: str) -> str:
    """A valid namespace of topics; ValueError for any other."""
    if not re.fullmatch(r"(/[A-Za-z_]\w*)+", namespace, re.ASCII):
        raise ValueError(f"{namespace!r} is no namespace; write one like /hopper or /lab/hopper")
    return namespace


@dataclass(frozen=True)
class _Profile:
    __pydantic_config__ = KEYS
    profile: Path


AnyDelay = Annotated[
    Annotated[_Profile, InKeys] | Annotated[Number, AfterValidator(_of_seconds), Plain], ByShape
]


@dataclass(frozen=True)
class _Delays:
    __pydantic_config__ = KEYS
    input: AnyDelay | None = None
    measurement: AnyDelay | None = None


@dataclass(frozen=True)
class _Start:
    __pydantic_config__ = KEYS
    position: Number = 0.0
    velocity: Number = 0.0


@dataclass(frozen=True)
class _Document:
    """Content of experiment.yaml."""

    __pydantic_config__ = KEYS
    excitation: AnyExcitation
    model: str | None = None
    forcing: Forcing | None = None
    delays: _Delays = _Delays()
    noise: Noise = Noise()
    time: TimeMode = TimeMode()
    duration: Annotated[Number, Field(ge=1e-6, le=1e6)] | None = None
    seed: Annotated[Whole, Field(ge=0, le=2**31 - 1)] = 0
    initial: Annotated[
        Annotated[_Start, InKeys] | Annotated[str, AfterValidator(_settled), Plain], ByShape
    ] = "limit_cycle"
    safety: Safety = Safety()
    record: Recording = Recording()
    namespace: Annotated[str, AfterValidator(of_topic)] = "/hopper"
    joint: str = "leg"
    elements: tuple[Path, ...] = ()


_DOCUMENT: TypeAdapter[_Document] = TypeAdapter(_Document)


def _delay(given: _Profile | float | None, model: Model, label: str, folder: Path) -> Delay:
    """The given delay, else that of the model."""
    if given is None:
        term = model.term(label)
        return Delay() if term is None else Delay(term.values["delay"].value)
    if isinstance(given, _Profile):
        delay = Delay(profile=folder / given.profile)
        delay.table()
        return delay
    return Delay(given)


def _experiment(
    document: Node, folder: Path, elements: tuple[Path, ...], instead: str | Path | None = None
) -> Experiment:
    given = validated(document, _DOCUMENT, {IN_FOLDER: folder})
    elements = (*elements, *(folder / path for path in given.elements))
    if instead is not None:
        model_path = Path(instead)
    elif given.model is None:
        document.fail("'model:' is missing")
    else:
        model_path = folder / given.model
        if not os.path.isfile(model_path):  # also if the name is too long for a file
            document.at("model").fail(f"no such file: {model_path}")
    model = Model.of_one_axis(model_path, load_catalogue(elements))
    place = document.at("excitation")
    try:
        duration = given.excitation.duration  # reads the table of samples
    except InputError as error:
        place.fail(str(error))
    forcing, assumed, model = resolved_forcing(given.forcing, model)
    if given.excitation.peak > given.safety.max_effort:
        place.fail(
            f"its peak of {given.excitation.peak:g} N exceeds safety.max_effort = {given.safety.max_effort:g} N"
        )
    return Experiment(
        model, model_path, given.excitation, place.plain, forcing,
        _delay(given.delays.input, model, "input_delay", folder),
        _delay(given.delays.measurement, model, "measurement_delay", folder),
        given.noise, given.time, duration if given.duration is None else given.duration, given.seed,
        None if isinstance(given.initial, str) else (given.initial.position, given.initial.velocity),
        given.safety, given.record, given.namespace, given.joint, folder, elements, assumed,
    )  # fmt: skip
