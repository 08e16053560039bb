"""A quadruped's joint as a single axis: inertia about its axis and gravity on it, with the following joints at given angles.

Read from a MuJoCo XML file with nested bodies: hip (about x), thigh, calf (about y), every inertial explicit.
"""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEGS, JOINTS = ("FL", "FR", "RL", "RR"), ("hip", "thigh", "calf")
AXES = {
    "hip": np.array([1.0, 0.0, 0.0]),
    "thigh": np.array([0.0, 1.0, 0.0]),
    "calf": np.array([0.0, 1.0, 0.0]),
}
GRAVITY = 9.81  # m/s^2
DOWN = np.array([0.0, 0.0, -1.0])  # the base hangs level
ARMATURE = 0.01  # kg m^2, the file's default class


@dataclass(frozen=True)
class JointModel:
    """One joint with all links beyond it: `inertia` [kg m^2] with the rotor's; gravity's torque is
    -moment * sin(q - reference), in N m and rad of the joint's own angle."""

    inertia: float
    moment: float
    reference: float


@dataclass(frozen=True)
class Link:
    """A body: `place` [3] of its joint in its parent, mass, its centre [3] and its inertia [3, 3] about it, in its own frame."""

    place: Array
    mass: float
    centre: Array
    inertia: Array


def joint_models(xml: Path, angles: Array) -> list[JointModel]:
    """Models of the twelve joints, in the order of LEGS by JOINTS, linearised about `angles` [12] rad."""
    root = ET.parse(xml).getroot()
    models: list[JointModel] = []
    for number, leg in enumerate(LEGS):
        links = [_link(root, f"{leg}_{joint}") for joint in JOINTS]
        models += [
            _one_joint(links, angles[3 * number : 3 * number + 3], moving) for moving in range(len(JOINTS))
        ]
    return models


def _one_joint(links: list[Link], angles: Array, moving: int) -> JointModel:
    rotation, place = np.eye(3), np.zeros(3)
    inertia, lever = ARMATURE, np.zeros(3)
    axis, origin = np.zeros(3), np.zeros(3)
    for number, (link, joint) in enumerate(zip(links, JOINTS)):
        place = place + rotation @ link.place
        if number == moving:
            axis, origin = rotation @ AXES[joint], place
        rotation = rotation @ _turn(AXES[joint], float(angles[number]))
        if number >= moving:
            arm = place + rotation @ link.centre - origin
            across = np.cross(axis, arm)
            inertia += link.mass * float(across @ across) + float(
                axis @ rotation @ link.inertia @ rotation.T @ axis
            )
            lever = lever + link.mass * arm
    weight = GRAVITY * DOWN
    now = float(axis @ np.cross(lever, weight))  # torque about the axis, and that a quarter turn further
    quarter = float(axis @ np.cross(_turn(axis, math.pi / 2) @ lever, weight))
    return JointModel(inertia, math.hypot(now, quarter), float(angles[moving]) - math.atan2(-now, -quarter))


def _link(root: ET.Element, name: str) -> Link:
    body = root.find(f".//body[@name='{name}']")
    inertial = body.find("inertial") if body is not None else None
    if body is None or inertial is None:
        raise ValueError(f"the XML has no body {name} with an inertial")
    turned = _quaternion(_numbers(inertial, "quat"))
    return Link(
        _numbers(body, "pos"),
        float(inertial.attrib["mass"]),
        _numbers(inertial, "pos"),
        turned @ np.diag(_numbers(inertial, "diaginertia")) @ turned.T,
    )


def _numbers(element: ET.Element, key: str) -> Array:
    return np.array([float(word) for word in element.attrib[key].split()])


def _turn(axis: Array, angle: float) -> Array:
    """Rotation [3, 3] by `angle` [rad] about a unit `axis` (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def _quaternion(q: Array) -> Array:
    """Rotation [3, 3] of a quaternion w, x, y, z."""
    w, x, y, z = q / np.linalg.norm(q)
    return _turn(
        np.array([x, y, z]) / max(np.linalg.norm([x, y, z]), 1e-12), 2 * math.atan2(math.hypot(x, y, z), w)
    )
