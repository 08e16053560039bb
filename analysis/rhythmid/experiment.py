"""One file says all of a run: machine, excitation, delays, noise, time mode, what is recorded and where.

`rhythmid simulate`, `rhythmid run` and the launch file read the same experiment.yaml. `Experiment.nodes` is the one
function that turns it into nodes with parameters; `perform` is the same run without ROS.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.document import Node, parse, read
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Excitation
from rhythmid.excitation.sequence import build
from rhythmid.model import Model
from rhythmid.record.messages import Messages
from rhythmid.settings import Delay, Forcing, Noise, Recording, Safety, TimeMode

TOPICS = ("excitation", "command", "forcing", "plant/joint_states", "joint_states", "run", "diagnostics")
LONGEST = 50_000_000  # samples of an offline run: 14 hours at 1 kHz, a few gigabytes


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
    """A run, completely described."""

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
    initial: tuple[float, float] | None = None  # None: on the limit cycle
    safety: Safety = Safety()
    record: Recording = Recording()
    namespace: str = "/hopper"
    joint: str = "leg"
    folder: Path = Path(".")
    elements: tuple[Path, ...] = ()

    @classmethod
    def load(
        cls, path: str | Path, elements: tuple[Path, ...] = (), model: str | Path | None = None
    ) -> "Experiment":
        """The experiment in a YAML file; paths in it are relative to it, except the bag's, which is relative to
        where the command is run. `model` is a model file that takes the place of the one named there. Raises InputError
        naming the line and key of what is wrong."""
        return _experiment(read(path), Path(path).resolve().parent, elements, model)

    @classmethod
    def from_text(cls, text: str, folder: str | Path = ".") -> "Experiment":
        """The experiment in a YAML text whose relative paths start at `folder`."""
        return _experiment(parse(text, "experiment"), Path(folder).resolve(), ())

    @property
    def count(self) -> int:
        """Number of samples N of every topic."""
        return max(1, round(self.duration * 1e9 / self.time.period_ns))

    @property
    def plant_model(self) -> Model:
        """The model with forcing and noise, as the plant runs it."""
        return plant_model(self.model, self.forcing, self.noise, load_catalogue(self.elements))

    def with_record(self, **changes: Any) -> "Experiment":
        """A copy that records otherwise."""
        return replace(self, record=replace(self.record, **changes))

    def description(self) -> dict[str, Any]:
        """What the topic `run` says: the experiment as run, without model, delays and noise, which are to be found."""
        return {
            "program": "rhythmid",
            "excitation": dict(self.excitation_spec),
            "forcing": {
                "amplitude": self.forcing.amplitude,
                "frequency": self.forcing.frequency,
                "phase": self.forcing.phase,
            },
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
        sinks = (
            ["recorder"] if streams else []
        )  # what the credit of lockstep waits for at the end of the path

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


def perform(experiment: Experiment) -> dict[str, Messages]:
    """Run the experiment without ROS: what each topic of the graph carries, by topic name within the namespace.

    Equals the graph's lockstep run, sample by sample and stamp by stamp. Raises InputError for a run too long to keep.
    """
    # the compiler behind the plant is slow to load, and most nodes need no plant
    from rhythmid.simulation.command_hold import RAMP, CommandHold
    from rhythmid.simulation.plant import Plant

    if experiment.count > LONGEST:
        raise InputError(
            f"{experiment.count} samples are too many to simulate at once; the limit is {LONGEST}"
        )
    period = experiment.time.period_ns
    stamps = np.arange(experiment.count, dtype=np.int64) * period
    time = (stamps * 1e-9).astype(np.float64)
    effort = ramped(experiment.excitation, experiment.safety, time, experiment.count * period * 1e-9)
    arrival = experiment.input_delay.release(stamps)
    plant = Plant(experiment.plant_model, period, experiment.seed, experiment.initial)
    plant.push_many(*CommandHold(experiment.safety.command_timeout, RAMP, period).fill(arrival, effort))
    samples = plant.advance(int(stamps[-1]))
    seen = experiment.measurement_delay.release(stamps)
    return {
        "excitation": Messages(stamps, effort=effort),
        "command": Messages(arrival, effort=effort),
        "forcing": Messages(stamps, effort=samples.forcing),
        "plant/joint_states": Messages(
            stamps, position=samples.position, velocity=samples.velocity, effort=samples.effort
        ),
        "joint_states": Messages(
            seen, position=samples.position, velocity=samples.velocity, effort=samples.effort
        ),
    }


def _delay(node: Node | None, folder: Path) -> Delay:
    if node is None:
        return Delay()
    if isinstance(node.value, dict):
        keys = node.mapping(["profile"])
        if "profile" not in keys:
            node.fail("a delay [s] or {profile: file.csv} is expected")
        delay = Delay(profile=folder / keys["profile"].text())
        delay.table()
        return delay
    value = node.number()
    if not 0.0 <= value <= 10.0:
        node.fail(f"{value:g} s is outside [0, 10]; a delay is in seconds and cannot be negative")
    return Delay(value)


def _numbers(node: Node | None, **limits: tuple[float, float]) -> dict[str, float]:
    """Keys of `node` as numbers within their limits; no other keys are allowed."""
    if node is None:
        return {}
    keys = node.mapping(list(limits))
    return {name: child.number(*limits[name]) for name, child in keys.items()}


def _experiment(
    document: Node, folder: Path, elements: tuple[Path, ...], instead: str | Path | None = None
) -> Experiment:
    keys = document.mapping(
        ["model", "excitation", "forcing", "delays", "noise", "time", "duration", "seed", "initial", "safety",
         "record", "namespace", "joint", "elements"]
    )  # fmt: skip
    for name in ("model", "excitation"):
        if name not in keys and not (name == "model" and instead):
            document.fail(f"'{name}:' is missing")
    if "elements" in keys:
        elements = (*elements, *(folder / item.text() for item in keys["elements"].items()))
    catalogue = load_catalogue(elements)
    if instead is not None:
        model_path = Path(instead)
    else:
        model_path = folder / keys["model"].text()
        if not model_path.is_file():
            keys["model"].fail(f"no such file: {model_path}")
    model = Model.load(model_path, catalogue)
    spec = keys["excitation"].plain
    if not isinstance(spec, dict):
        keys["excitation"].fail("a mapping with a 'type' is expected")
    try:
        excitation = build(spec, folder)
    except InputError as error:
        raise InputError(f"{keys['excitation'].place}: {error}") from None
    far = (-math.inf, math.inf)
    forcing = Forcing(**_numbers(keys.get("forcing"), amplitude=far, frequency=(1e-6, 1e6), phase=far))
    if "forcing" not in keys and model.term("periodic_forcing") is not None:
        term = model.term("periodic_forcing")
        assert term is not None
        forcing = Forcing(**{name: value.value for name, value in term.values.items()})
    elif model.term("periodic_forcing") is not None:
        model = model.without("periodic_forcing")
    delays = keys["delays"].mapping(["input", "measurement"]) if "delays" in keys else {}
    nodes_delay = {name: _delay(delays.get(name), folder) for name in ("input", "measurement")}
    for name, label in (("input", "input_delay"), ("measurement", "measurement_delay")):
        if name not in delays and (term := model.term(label)) is not None:
            nodes_delay[name] = Delay(term.values["delay"].value)
    noise = Noise(
        **_numbers(keys.get("noise"), measurement_std=(0, math.inf), correlation=(0, 0.9999),
                   quantisation=(0, math.inf))
    )  # fmt: skip
    time = _time(keys.get("time"))
    duration = keys["duration"].number(1e-6, 1e6) if "duration" in keys else excitation.duration
    initial = None
    if "initial" in keys and keys["initial"].value != "limit_cycle":
        if not isinstance(keys["initial"].value, dict):
            keys["initial"].fail("limit_cycle or {position: …, velocity: …} is expected")
        given = keys["initial"].mapping(["position", "velocity"])
        initial = (
            given["position"].number() if "position" in given else 0.0,
            given["velocity"].number() if "velocity" in given else 0.0,
        )
    seed = keys["seed"].whole(0, 2**31 - 1) if "seed" in keys else 0
    namespace = keys["namespace"].text() if "namespace" in keys else "/hopper"
    if not re.fullmatch(r"(/[A-Za-z_]\w*)+", namespace, re.ASCII):
        keys["namespace"].fail(f"{namespace!r} is no namespace; write one like /hopper or /lab/hopper")
    experiment = Experiment(
        model, model_path, excitation, spec, forcing, nodes_delay["input"], nodes_delay["measurement"], noise, time,
        duration, seed, initial, _safety(keys.get("safety")), _recording(keys.get("record")), namespace,
        keys["joint"].text() if "joint" in keys else "leg", folder, elements,
    )  # fmt: skip
    if excitation.peak > experiment.safety.max_effort:
        keys["excitation"].fail(
            f"its peak of {excitation.peak:g} N exceeds safety.max_effort = {experiment.safety.max_effort:g} N"
        )
    return experiment


def _time(node: Node | None) -> TimeMode:
    if node is None:
        return TimeMode()
    keys = node.mapping(["mode", "rate", "window", "layout"])
    made: dict[str, Any] = {}
    if "mode" in keys:
        made["mode"] = keys["mode"].choice(["lockstep", "realtime"])
    if "layout" in keys:
        made["layout"] = keys["layout"].choice(["composed", "processes"])
    if "rate" in keys:
        made["rate"] = keys["rate"].whole(1, 100_000)
    if "window" in keys:
        made["window"] = keys["window"].whole(1, 100)
    return TimeMode(**made)


def _safety(node: Node | None) -> Safety:
    if node is None:
        return Safety()
    numbers = {"max_effort": 0.0, "ramp": 0.0, "stale_after": 1e-3, "max_speed": 0.0, "frozen_after": 0.0,
               "max_gap": 0.0, "command_timeout": 0.0}  # fmt: skip
    keys = node.mapping([*numbers, "envelope"])
    made: dict[str, Any] = {name: keys[name].number(low=low) for name, low in numbers.items() if name in keys}
    if "envelope" in keys:
        ends = [end.number(finite=False) for end in keys["envelope"].items()]
        if len(ends) != 2 or not ends[0] < ends[1]:
            keys["envelope"].fail("two positions [low, high] in m are expected, low < high")
        made["envelope"] = (ends[0], ends[1])
    return Safety(**made)


def _recording(node: Node | None) -> Recording:
    if node is None:
        return Recording()
    keys = node.mapping(["path", "storage", "topics"])
    made: dict[str, Any] = {}
    if "path" in keys:
        made["path"] = Path(keys["path"].text())
    if "storage" in keys:
        made["storage"] = keys["storage"].choice(["mcap", "sqlite3"])
    if "topics" in keys:
        made["topics"] = tuple(item.choice(TOPICS) for item in keys["topics"].items())
    return Recording(**made)
