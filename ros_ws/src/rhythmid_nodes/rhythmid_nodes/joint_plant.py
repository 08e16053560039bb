"""plant of several joints: takes `command`, publishes one `joint_states` with all joints; the physics is rhythmid's and MuJoCo's."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from rhythmid.body.joint_experiment import JointExcitation, JointExperiment, command_field
from rhythmid.body.joint_hold import JointHold
from rhythmid.body.joint_plant import FIELDS, JointPlant
from rhythmid.body.machine import Machine
from rhythmid.errors import InputError

from .joint_states import JointStatesReader, JointStatesWriter
from .node import run
from .parameters import Parameter
from .plant import PARAMETERS as OF_ONE_AXIS
from .plant import PlantNode
from .sample import Sample

SHARED = (
    "rate", "time_mode", "window", "count", "priority", "catch_up", "command_timeout", "command_ramp", "consumers",
)  # fmt: skip
EXPERIMENT = Parameter("experiment", "", "experiment file of a machine of several joints")
PARAMETERS = (*(one for one in OF_ONE_AXIS if one.name in SHARED), EXPERIMENT)


class JointCommand(NamedTuple):
    """A command of all joints, references or forces, in the plant's order."""

    stamp_ns: int
    effort: NDArray[np.float64]


def loaded(path: str) -> tuple[JointExperiment, Machine]:
    """An experiment and its machine. Raises InputError if either is missing."""
    if not path:
        raise InputError("parameter experiment is missing: name an experiment file")
    experiment = JointExperiment.load(path)
    if experiment.model is None:
        raise InputError(f"{path}: 'model:' is missing")
    return experiment, Machine.load(experiment.model)


class JointPlantNode(PlantNode):
    """The plant node with a body in the place of the one mass. Commands are kept within the `limits` of their joint's excitation."""

    def __init__(self, **options: Any) -> None:
        super().__init__(PARAMETERS, **options)

    def _build(self) -> JointPlant:
        self._experiment, self._machine = loaded(self.values["experiment"])
        self._experiment.plant(self._machine).advance(2 * self.period_ns)  # compiles
        return self._experiment.plant(self._machine)

    def _open(self, profile: QoSProfile) -> None:
        machine, joints = self._machine, self._machine.joints
        self._unlimited = True  # except for the limits of each joint
        self._field = command_field(machine)
        self._reader = JointStatesReader(joints)
        self._state_writer = JointStatesWriter(self._plant.measured, *FIELDS)
        self._states = self.create_publisher(JointState, "joint_states", profile)
        fading = np.array([not machine.controlled(joint) for joint in joints])
        self._hold = JointHold(
            self.values["command_timeout"], self.values["command_ramp"], self.period_ns, fading
        )
        self._hold.renew(0, self._plant.held)
        known = self._experiment.excitation
        self._bounds = np.array([known.get(joint, JointExcitation()).limits for joint in joints]).T

    def _within_limits(self, sample: list[Sample]) -> JointCommand | None:
        asked = np.array([getattr(one, self._field) for one in sample])
        if not np.isfinite(asked).all():
            self.trip(f"a command of {asked.tolist()} on {self._authority.topic}")
            return None
        clamped = np.clip(asked, *self._bounds)
        self._clamped += bool(np.any(clamped != asked))
        return JointCommand(sample[0].stamp_ns, clamped)

    def _named(self) -> str:
        return f"all of the joints {', '.join(self._machine.joints)}"

    def _nothing(self) -> NDArray[np.float64]:
        return self._hold.faded()

    def _publish(self, until_ns: int, origin_ns: int, newest_only: bool = False) -> None:
        stamps, states = self._plant.states(until_ns)
        for k in range(len(stamps))[-1 if newest_only else 0 :]:
            rows = (states[name][k] for name in FIELDS)
            self._states.publish(self._state_writer.write(int(stamps[k]) + origin_ns, *rows))
            self._samples += 1


def main() -> None:
    run(JointPlantNode)


if __name__ == "__main__":
    main()
