"""Recordings of legged machines that are simulated, with the clutter of real ones."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhythmid.body.machine import Machine
from rhythmid.body.simulate import simulate
from rhythmid.record.joint_record import JointRecord
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import continuous, spline

# two links that hang from a base, with hinges about one horizontal axis
TWO_LINKS = """<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
    <inertia ixx="0.03" iyy="0.03" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0.02 -0.15" rpy="0.1 0.2 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.012" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="one" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
  <joint name="two" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
</robot>
"""
# of each of its joints
CONTROLLED = (
    "{command: [{input_delay: {delay: 0.0}}, {position_control: {proportional: {value: 80, fixed: true}, "
    "derivative: {value: 2.0, fixed: true}}}], force: [{viscous_damper: {damping: 0.1}}]}"
)
MODELS = Path(str(files("rhythmid"))) / "models" / "legs"
Array = NDArray[np.float64]


def two_links(folder: Path, robot: str = TWO_LINKS, body: str = "") -> Machine:
    """The machine of a `robot` with the joints of `TWO_LINKS` under position control; more keys of its `body`."""
    (folder / "two.urdf").write_text(robot)
    paths = f"joints:\n  one: {CONTROLLED}\n  two: {CONTROLLED}\n"
    (folder / "two.yaml").write_text(f"body: {{urdf: two.urdf, contacts: false{body}}}\n{paths}")
    return Machine.load(folder / "two.yaml")


def fixed_leg(folder: Path) -> Path:
    """Files of the leg with its trunk held fast, in the air; the model's."""
    text = (MODELS / "leg.xml").read_text()
    rail = text[text.index('<joint name="rail"') :]
    (folder / "leg.xml").write_text(text.replace(rail[: rail.index(">") + 1], ""))
    body = (
        (MODELS / "leg.yaml").read_text().replace("base: rail, step: 0.0005", "step: 0.001, contacts: false")
    )
    (folder / "leg.yaml").write_text(body)
    xml = (folder / "leg.xml").read_text()
    (folder / "leg.xml").write_text(xml.replace('<keyframe><key qpos="0.42 0.6 -1.2"/></keyframe>', ""))
    return folder / "leg.yaml"


def multisine(time: Array, rng: np.random.Generator, low: float, high: float, count: int = 6) -> Array:
    """A sum of sines of random phases, of unit rms."""
    frequency = np.linspace(low, high, count) * (1.0 + 0.05 * rng.normal(size=count))
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    return np.sqrt(2.0 / count) * np.sin(2.0 * np.pi * frequency * time[:, None] + phase).sum(axis=1)


def references(
    joints: Mapping[str, tuple[float, float]],
    time: Array,
    rng: np.random.Generator,
    band: tuple[float, float],
) -> dict[str, Array]:
    """A multisine for each joint about a middle [rad] with an rms [rad], faded in."""
    fade = np.clip(time / 0.5, 0.0, 1.0)
    return {
        joint: middle + size * fade * multisine(time, rng, *band) for joint, (middle, size) in joints.items()
    }


def hop(time: Array, rng: np.random.Generator) -> dict[str, Array]:
    """References that make the leg hop, and swing while it flies."""
    rate = 1.9 + 0.1 * rng.normal()
    phase = 2.0 * np.pi * rate * time
    amplitude = 0.33 * (1.0 + 0.15 * np.sin(2.0 * np.pi * 0.23 * time + rng.uniform(0.0, 6.0)))
    wave = amplitude * np.sin(phase)
    more = 0.12 * multisine(time, rng, 2.5, 9.0)
    other = 0.12 * multisine(time, rng, 2.5, 9.0)
    return {"hip": 0.6 + wave + more, "knee": -1.2 - 2.0 * wave + other}


def recorded(
    plant: Machine,
    asked: Mapping[str, Array],
    time: Array,
    rng: np.random.Generator,
    rate: float = 500.0,
    jitter: float = 3e-4,
    encoder: float = 2.0 * np.pi / 16384.0,
    torque_noise: float = 0.01,
    with_effort: bool = True,
    lost: float = 0.002,
    held: bool = False,
) -> JointRecord:
    """A run of the plant as a logger has it: stamps that jitter [s], an encoder's steps [rad], noise of the torque as a share of its
    rms, and messages that were lost (share). A reference that is `held` from stamp to stamp is in the torque as it is at that instant."""
    stamps = np.arange(float(time[0]), float(time[-1]), 1.0 / rate)
    late = np.abs(rng.normal(0.0, jitter, len(stamps)))
    at = np.maximum.accumulate(stamps + late)
    if held:
        asked = {joint: np.interp(stamps, time, values) for joint, values in asked.items()}
        time = stamps
    command = {
        joint: continuous(time, values, "zero") if held else spline(time, values)
        for joint, values in asked.items()
    }
    start = {joint: float(values[0]) for joint, values in asked.items()}
    run = simulate(plant, at, command, start=start)
    kept = rng.uniform(size=len(stamps)) >= lost
    kept[[0, -1]] = True
    made: dict[str, Record] = {}
    for place, joint in enumerate(plant.joints):
        position = encoder * np.round(run.output[:, place] / encoder)
        effort = (
            np.zeros(len(stamps))
            if not with_effort
            else asked_effort(plant, joint, run, place, asked, time, held)
        )
        effort = effort + torque_noise * np.sqrt(np.mean(effort**2)) * rng.normal(size=len(stamps))
        given = np.interp(stamps, time, asked[joint])
        made[joint] = Record(
            "run",
            Channel(stamps[kept], position[kept], "rad"),
            input=Channel(stamps, given, "rad"),
            effort=Channel(stamps[kept], effort[kept], "N*m") if with_effort else None,
            input_kind="reference",
        )
    base = None
    if plant.body.base in plant.body.joints:
        pose = run.pose[:, plant.body.joints[plant.body.base].position]
        base = Record(
            "run", Channel(stamps[kept], (encoder * 0.1) * np.round(pose / (encoder * 0.1))[kept], "m")
        )
    return JointRecord("run", made, base)


def asked_effort(
    plant: Machine, joint: str, run, place: int, asked: Mapping[str, Array], time: Array, held: bool
) -> Array:
    """The torque that the joint's drive reports: what its controller asked for."""
    model = plant.paths[joint]
    late = model.value("input_delay.delay") if "input_delay.delay" in model.parameters else 0.0
    middle = run.time - late + 0.5 * plant.body.step  # a step takes the mean of its command
    reference = np.interp(middle, time, asked[joint])
    if held:
        reference = asked[joint][np.searchsorted(time, run.time - late + 1e-9, side="right") - 1]
    kp, kd = model.value("position_control.proportional"), model.value("position_control.derivative")
    return kp * (reference - run.position[:, place]) - kd * run.velocity[:, place]
