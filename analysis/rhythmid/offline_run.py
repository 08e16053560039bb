"""An experiment run without ROS: the content of every topic, as a record and as a bag."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.experiment import LONGEST_RUN, Experiment, ramped
from rhythmid.model import Model
from rhythmid.output import require_new
from rhythmid.plain_yaml import plain_yaml
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.messages import Messages
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import Signals
from rhythmid.result import Result, Row, axis_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

    from rhythmid.body.machine import Machine


@dataclass(frozen=True, eq=False)
class OfflineRun(Result):
    """A simulated experiment.

    Attributes
    ----------
    experiment
        As it was run.
    messages
        Content of each topic, by its name within the namespace; the true motion is `plant/joint_states`.

    Examples
    --------
    >>> import rhythmid as rh
    >>> run = rh.simulate(rh.paper_hopper(), {"excitation": {"type": "chirp", "amplitude": 0.01, "sweep": 2.0}})
    >>> sorted(run.record.channels)
    ['forcing', 'input', 'output']
    """

    experiment: Experiment
    messages: Mapping[str, Messages]

    @property
    def record(self) -> Record:
        """The run as seen by a user of the robot: command, forcing and the delayed, noisy position."""
        known = self.experiment
        sources = Signals.default(known.namespace, known.joint).channels
        topics = {"output": "joint_states", "input": "excitation", "forcing": "forcing"}
        channels = {}
        for role, topic in topics.items():
            sent = self.messages[topic]
            value = sent.position if role == "output" else sent.effort
            assert value is not None
            channels[role] = Channel(
                (sent.stamp_ns * 1e-9).astype(np.float64), value, sources[role].unit, str(sources[role])
            )
        return Record(known.model_path.stem, run=known.description(), **channels)

    @property
    def headline(self) -> str:
        """Length and rate of the run."""
        return f"{self.experiment.count} samples at {self.experiment.time.rate} Hz"

    def topics(self, all_topics: bool = False) -> tuple[str, ...]:
        """Topics that the experiment records, or all of them."""
        wanted = self.messages if all_topics else self.experiment.record.topics
        return tuple(topic for topic in wanted if topic in self.messages)

    def save(self, path: str | Path, all_topics: bool = False) -> Path:
        """Write the bag that the graph would record; with `all_topics` also the true output and command.

        Raises
        ------
        InputError
            Where the path exists or cannot be written.
        """
        path = Path(path)
        require_new(path)
        known = self.experiment
        write_bag(
            path,
            {f"{known.namespace}/{topic}": self.messages[topic] for topic in self.topics(all_topics)},
            storage=known.record.storage,
            run=known.description(),
            joint=known.joint,
            namespace=known.namespace,
        )
        return path

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`topics`: how many messages each carries, and which fields."""
        rows = [
            {
                "topic": f"{self.experiment.namespace}/{topic}",
                "messages": len(sent),
                "fields": ", ".join(
                    n for n in ("position", "velocity", "effort") if getattr(sent, n) is not None
                ),
            }
            for topic, sent in self.messages.items()
        ]
        return {"topics": rows}

    def to_dict(self) -> dict[str, Any]:
        """The experiment's description and the topics; the samples are in `messages`."""
        return {
            "experiment": self.experiment.description(),
            "topics": [dict(row) for row in self.tables()["topics"]],
        }

    def show(self, console: "Console") -> None:
        """Print length, rate and topics."""
        console.print(f"{self.headline} of {', '.join(self.messages)}", highlight=False)
        for note in self.experiment.notes:
            console.print(f"note: {note}", markup=False, highlight=False)

    def plot(self, axis: "Axes | None" = None) -> "Axes":
        """Draw the measured position over time; see `Record.plot`."""
        return self.record.plot(axis_or_new(axis))


def simulate(
    model: "Model | Machine | str | Path | None",
    experiment: Mapping[str, Any] | str | Path,
    elements: Sequence[str | Path] = (),
) -> OfflineRun:
    """Run an experiment without ROS.

    Parameters
    ----------
    model
        The machine, or its file; None for the model named in the experiment.
    experiment
        An experiment.yaml, or its content as a mapping: excitation, forcing, delays, noise, duration, …
    elements
        Folders with elements of your own.

    Returns
    -------
    OfflineRun
        With the `record` for an identification; `save` writes the bag. A machine of several joints gives a `JointRun`,
        which has both as well.

    Raises
    ------
    InputError
        In one line, naming the wrong key, or if the simulation diverges.

    Examples
    --------
    >>> import rhythmid as rh
    >>> run = rh.simulate(
    ...     rh.paper_hopper(),
    ...     {"excitation": {"type": "chirp", "amplitude": 0.004, "sweep": 0.5}, "delays": {"input": 0.04}},
    ... )
    >>> run.headline
    '500 samples at 1000 Hz'
    >>> run.record.output.value.shape
    (500,)
    """
    if isinstance(model, (str, Path)):
        catalogue = load_catalogue(tuple(Path(one) for one in elements))
        loaded = Model.load(model, catalogue)
        model = model if isinstance(loaded, Model) else loaded
    if model is not None and not isinstance(model, (Model, str, Path)):
        from rhythmid.body.joint_run import run_experiment  # it needs MuJoCo

        return cast(OfflineRun, run_experiment(model, experiment))
    with TemporaryDirectory(prefix="rhythmid_") as folder:
        path = Path(folder) / "model.yaml" if isinstance(model, Model) else model
        if isinstance(model, Model):
            model.save(Path(folder) / "model.yaml")
        described = _described(path, experiment, tuple(Path(one).resolve() for one in elements))
    return OfflineRun(described, perform(described))


def _described(
    model: str | Path | None, experiment: Mapping[str, Any] | str | Path, elements: tuple[Path, ...]
) -> Experiment:
    """The experiment with its model replaced by that in a file."""
    if not isinstance(experiment, Mapping):
        return Experiment.load(experiment, elements, model)
    content = dict(experiment)
    if model is not None:
        content["model"] = str(Path(model).resolve())
    if elements:
        content["elements"] = [*content.get("elements", ()), *elements]
    return Experiment.from_text(plain_yaml(content, "experiment"))


def perform(experiment: Experiment) -> dict[str, Messages]:
    """Run the experiment without ROS. Returns the content of each topic of the graph, by topic name within the namespace.

    Equals the graph's lockstep run, sample by sample and stamp by stamp. Raises InputError for a run too long to keep.
    """
    # the plant's compiler is slow to load, and most nodes do not need a plant
    from rhythmid.simulation.command_hold import RAMP, CommandHold
    from rhythmid.simulation.plant import Plant

    if experiment.count > LONGEST_RUN:
        raise InputError(
            f"{experiment.count} samples are too many to simulate at once; the limit is {LONGEST_RUN}"
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
