"""An experiment with a machine of several joints, run without ROS, as a record and as a bag."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rhythmid.body.joint_experiment import JointExperiment, JointMessages, command_field, perform
from rhythmid.body.machine import Machine
from rhythmid.record.joint_messages import write_joint_bag
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel, Record
from rhythmid.result import Result, Row

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, eq=False)
class JointRun(Result):
    """A simulated experiment with a machine: `messages` are the content of its topics."""

    machine: Machine
    experiment: JointExperiment
    messages: JointMessages

    @property
    def record(self) -> JointRecord:
        """The run in the form in which `load` reads it from its bag."""
        time = (self.messages.stamp_ns * 1e-9).astype(np.float64)
        (_, command), (joints, states) = (
            self.messages.topics[f"{self.experiment.namespace}/{name}"]
            for name in ("command", "joint_states")
        )
        records = {}
        for place, joint in enumerate(joints):
            angle, force = ("rad", "N*m") if self.machine.body.joints[joint].rotational else ("m", "N")
            one = Record("run", Channel(time, states["position"][:, place], angle))
            if joint in self.machine.joints:
                value = command[command_field(self.machine)][:, self.machine.joints.index(joint)]
                closed = self.machine.controlled(joint)
                effort = Channel(time, states["effort"][:, place], force)
                asked = Channel(time, value, angle if closed else force)
                one = replace(one, input=asked, effort=effort, input_kind="reference" if closed else "force")
            records[joint] = one
        base = records.pop(self.machine.body.base, None)
        return JointRecord("run", records, base, "after_actuator", "mean")

    @property
    def headline(self) -> str:
        """Length of the run."""
        return f"{len(self.messages.stamp_ns)} samples"

    def save(self, path: str | Path) -> Path:
        """Write the bag that the ROS graph would record. Raises InputError where the path exists or cannot be written."""
        stamps = self.messages.stamp_ns
        return write_joint_bag(
            Path(path), {topic: (stamps, *rest) for topic, rest in self.messages.topics.items()}
        )

    def show(self, console: "Console") -> None:
        console.print(self.headline)

    def to_dict(self) -> dict[str, Any]:
        """Length and topics."""
        return {"samples": len(self.messages.stamp_ns), "topics": list(self.messages.topics)}

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """The `topics`, with the joints in each."""
        return {
            "topics": [
                {"topic": topic, "joints": ", ".join(joints)}
                for topic, (joints, _) in self.messages.topics.items()
            ]
        }


def run_experiment(machine: Machine, experiment: Mapping[str, Any] | str | Path) -> JointRun:
    """Run an experiment, given as a file or as its content. Raises InputError as `perform` does.

    Examples
    --------
    >>> import rhythmid as rh
    >>> from importlib.resources import files
    >>> folder = files("rhythmid") / "models" / "legs"
    >>> leg = rh.Model.load(folder / "leg.yaml")
    >>> knee = {"offset": -1.2, "type": "chirp", "amplitude": 0.3, "band": [0.5, 6.0], "sweep": 4.0}
    >>> hip = {"offset": 0.6, "type": "chirp", "amplitude": 0.3, "band": [0.5, 5.0], "sweep": 4.0}
    >>> run = rh.simulate(leg, {"duration": 4.0, "start": {"rail": 0.45}, "excitation": {"hip": hip, "knee": knee}})
    >>> run.headline
    '4000 samples'
    >>> found = rh.identify(run.record, leg)
    >>> round(found.parameters["body.knee.armature"].value, 4)
    0.006
    """
    described = (
        JointExperiment.of(experiment)
        if isinstance(experiment, Mapping)
        else JointExperiment.load(experiment)
    )
    return JointRun(machine, described, perform(machine, described))
