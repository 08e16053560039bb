"""excitation of several joints: publishes one `command` with a reference or a force for each joint when told to.

Services, states and supervision are those of `excitation`; the limits of positions and speeds apply to each joint. A run that ends or is
stopped keeps the last references, and sets forces to zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState

from rhythmid.body.joint_experiment import JointExcitation, JointExperiment, JointWatch, command_field

from .excitation import ExcitationNode
from .excitation_parameters import PARAMETERS as OF_ONE_AXIS
from .joint_plant import EXPERIMENT, loaded
from .joint_states import JointStatesReader, JointStatesWriter
from .node import run
from .qos import stream
from .sample import Sample
from .watch import Limits, Watch

SHARED = (
    "rate", "time_mode", "window", "count", "priority", "catch_up", "ramp", "run", "subscribers", "unattended", "recorder",
    "consumers",
)  # fmt: skip
PARAMETERS = (*(one for one in OF_ONE_AXIS if one.name in SHARED), EXPERIMENT)


class JointCommander:
    """Publishes a command of all joints on `command`."""

    def __init__(self, publisher: Publisher, writer: JointStatesWriter) -> None:
        self.publisher, self._writer = publisher, writer

    def send(self, stamp_ns: int, command: NDArray[np.float64]) -> None:
        """Publish a command (joints,) with its stamp [ns]."""
        self.publisher.publish(self._writer.write(stamp_ns, command))


class JointsWatch:
    """Judges the measurements of all joints, each by its own limits."""

    def __init__(
        self, experiment: JointExperiment, joints: tuple[str, ...], topic: str, units: Mapping[str, str]
    ) -> None:
        safety = experiment.safety
        self._watches: dict[str, Watch] = {}
        for joint in joints:
            own = safety.joints.get(joint, JointWatch())
            self._watches[joint] = Watch(
                Limits(
                    safety.stale_after,
                    *own.envelope,
                    own.max_speed,
                    safety.frozen_after,
                    safety.max_gap,
                    unit=units.get(joint, "m"),
                ),
                f"joint {joint} on {topic}",
            )

    def hear(self, samples: list[Sample], arrived_ns: int) -> None:
        """Store a measurement of every joint."""
        for watch, sample in zip(self._watches.values(), samples):
            watch.hear(sample, arrived_ns)

    def hear_others(self, joints: Sequence[str]) -> None:
        """Note which joints a message names that lacks some."""
        for joint, watch in self._watches.items():
            if joint not in joints:
                watch.hear_others(joints)

    def danger(self, now_ns: int) -> str:
        """Reason why the machine must not be excited now, and the joint; empty if it may."""
        for joint, watch in self._watches.items():
            if danger := watch.danger(now_ns):
                return f"{joint}: {danger}"
        return ""


class JointExcitationNode(ExcitationNode):
    """Plays precomputed commands of all joints."""

    HALTED = "forces are zero at once, without fading, and references keep their last value"

    def __init__(self, **options: Any) -> None:
        super().__init__(PARAMETERS, **options)

    def _command(self) -> NDArray[np.float64]:
        self._experiment, self._machine = loaded(self.values["experiment"])
        self._played = "the commands of all joints"
        known = self._experiment.excitation
        joints = self._machine.joints
        self._middle = np.array([known.get(joint, JointExcitation()).offset for joint in joints])
        self._forces = np.array([not self._machine.controlled(joint) for joint in joints])
        asked = self._experiment.asked(self._machine)
        self._last = asked[0]
        return asked

    def _judge(self) -> JointsWatch:
        self._reader = JointStatesReader(self._machine.joints)
        joints = self._machine.joints
        units = {joint: "rad" if self._machine.body.joints[joint].rotational else "m" for joint in joints}
        return JointsWatch(self._experiment, joints, self.resolve_topic_name("joint_states"), units)

    def _commander(self) -> JointCommander:
        publisher = self.create_publisher(JointState, "command", stream(self.lockstep))
        return JointCommander(
            publisher, JointStatesWriter(self._machine.joints, command_field(self._machine))
        )

    def _value(self, index: int) -> NDArray[np.float64]:
        """The commands of sample `index`; faded out to the offsets when asked to stop."""
        share = self._share(index)
        self._last = (
            self._effort[index]
            if share == 1.0
            else self._middle + share * (self._effort[index] - self._middle)
        )
        return self._last

    def _nothing(self) -> NDArray[np.float64]:
        return np.where(self._forces, 0.0, self._last)


def main() -> None:
    run(JointExcitationNode)


if __name__ == "__main__":
    main()
