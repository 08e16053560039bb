"""Recordings as other robots make them: their topics, types, names and rates; and the small machines that are behind them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from rhythmid.record.bag_writer import add_topic, new_bag
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.start.start import guess

Array = NDArray[np.float64]
STORE = get_typestore(Stores.ROS2_JAZZY)
STEP = 1e-3


def tones(seed: int, time: Array, rms: float = 1.0, low: float = 0.3, high: float = 4.0) -> Array:
    """A sum of ten sines."""
    rng = np.random.default_rng(seed)
    frequency, phase = np.geomspace(low, high, 10), rng.uniform(0.0, 2.0 * np.pi, 10)
    return rms * np.sqrt(0.2) * np.sin(2.0 * np.pi * np.outer(time, frequency) + phase).sum(axis=1)


def moved(
    force: Array, mass: float, damping: float, stiffness: float, dry: float = 0.0
) -> tuple[Array, Array]:
    """Position and speed (n,) of a mass on a damped spring with dry friction, from rest; steps of 1 ms."""
    position, speed = np.zeros(len(force)), np.zeros(len(force))
    x = v = 0.0
    for k, pushed in enumerate(force):
        position[k], speed[k] = x, v
        v += STEP * (pushed - damping * v - stiffness * x - dry * np.tanh(v / 0.005)) / mass
        x += STEP * v
    return position, speed


def servo(reference: Array, gain: float = 400.0, damping: float = 28.0) -> tuple[Array, Array, Array]:
    """Position, speed and torque (n,) of a unit inertia under proportional and derivative control."""
    position, speed, torque = (np.zeros(len(reference)) for _ in range(3))
    x = v = 0.0
    for k, wanted in enumerate(reference):
        force = gain * (wanted - x) - damping * v
        position[k], speed[k], torque[k] = x, v, force
        v += STEP * force
        x += STEP * v
    return position, speed, torque


def roles_of(path: Path, **options: Any) -> dict[str, str]:
    """What `init` takes for each role, after its signals.yaml was read back and a record with it."""
    found = guess(path, **options)
    read_record(path, Signals.from_text(found.signals))
    return {role: str(choice.recorded) for role, choice in found.roles.choices.items()}


def message(kind: str, stamp: float | None = None, **values: Any) -> Any:
    """A message of a standard type; `stamp` [s] goes into its header."""
    made = STORE.types[kind]
    if stamp is None:
        return made(**values)
    nanoseconds = round(stamp * 1e9)
    time = STORE.types["builtin_interfaces/msg/Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return made(header=STORE.types["std_msgs/msg/Header"](stamp=time, frame_id=""), **values)


def joint_state(stamp: float, names: list[str], **fields: Any) -> Any:
    """A JointState; `position`, `velocity`, `effort` where given."""
    lists = {key: np.array(fields.get(key, []), dtype=float) for key in ("position", "velocity", "effort")}
    return message("sensor_msgs/msg/JointState", stamp, name=names, **lists)


def array(values: Any) -> Any:
    layout = STORE.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    return message("std_msgs/msg/Float64MultiArray", layout=layout, data=np.array(values, dtype=float))


def wrench(stamp: float, x: float, z: float) -> Any:
    vector = STORE.types["geometry_msgs/msg/Vector3"]
    made = STORE.types["geometry_msgs/msg/Wrench"](
        force=vector(x=x, y=0.0, z=z), torque=vector(x=0.0, y=0.0, z=0.0)
    )
    return message("geometry_msgs/msg/WrenchStamped", stamp, wrench=made)


def imu(stamp: float, z: float) -> Any:
    vector, none = STORE.types["geometry_msgs/msg/Vector3"], np.zeros(9)
    still = STORE.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    return message(
        "sensor_msgs/msg/Imu", stamp, orientation=still, orientation_covariance=none, angular_velocity=vector(x=0.0, y=0.0, z=0.0),
        angular_velocity_covariance=none, linear_acceleration=vector(x=0.0, y=0.0, z=z), linear_acceleration_covariance=none,
    )  # fmt: skip


def pose(stamp: float, z: float) -> Any:
    still = STORE.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    point = STORE.types["geometry_msgs/msg/Point"](x=0.0, y=0.0, z=z)
    made = STORE.types["geometry_msgs/msg/Pose"](position=point, orientation=still)
    return message("geometry_msgs/msg/PoseStamped", stamp, pose=made)


def write(path: Path, topics: Mapping[str, list[tuple[float, Any]]]) -> Path:
    """A bag of messages by topic, each with its time of receipt [s]."""
    with new_bag(path) as writer:
        places = {name: add_topic(writer, name, rows[0][1].__msgtype__) for name, rows in topics.items()}
        every = sorted(
            ((time, name, one) for name, rows in topics.items() for time, one in rows), key=lambda row: row[0]
        )
        for time, name, one in every:
            writer.write(places[name], round(time * 1e9), STORE.serialize_cdr(one, one.__msgtype__))
    return path
