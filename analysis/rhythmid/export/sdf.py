"""SDFormat for Gazebo: joints with `dynamics` (damping, friction, spring) and the plugin that takes their command."""

import math
import xml.etree.ElementTree as tree
from collections.abc import Sequence

from rhythmid.export.joint import Joint, number
from rhythmid.export.link import link_of, world_gravity
from rhythmid.export.xml_text import add, comment, document, vector

VERSION = "1.9"  # of the format; what Gazebo Garden and later read
EXPRESSED = frozenset(
    (
        "inertia", "gravity", "weight_moment", "hanging_position", "damping", "friction", "stiffness", "spring_reference",
        "effort_limit",
    )
)  # fmt: skip
CONTROLLED = frozenset(("position_gain", "velocity_gain", "gain"))  # in a controller's gains
SYSTEMS = {
    "force": ("gz-sim-apply-joint-force-system", "gz::sim::systems::ApplyJointForce"),
    "position": ("gz-sim-joint-position-controller-system", "gz::sim::systems::JointPositionController"),
    "velocity": ("gz-sim-joint-controller-system", "gz::sim::systems::JointController"),
}


def text(joints: Sequence[Joint], source: str) -> str:
    """The SDF model of joints. Raises InputError where they ask for different gravities."""
    root = tree.Element("sdf", version=VERSION)
    model = add(root, "model", name=joints[0].name)
    comment(model, f"identified by rhythmid: {source}")
    comment(model, f"the world's gravity is {world_gravity(joints):.6g} m/s^2 along -z")
    for joint in joints:
        _link(model, joint)
        _joint(model, joint)
        _plugin(model, joint)
    return document(root)


def _link(model: tree.Element, joint: Joint) -> None:
    link = link_of(joint)
    inertial = add(add(model, "link", name=f"{joint.name}_link"), "inertial")
    add(inertial, "pose", vector((*link.centre, 0.0, 0.0, 0.0)))
    add(inertial, "mass", number(link.mass))
    inertia = add(inertial, "inertia")
    for name in ("ixx", "iyy", "izz"):
        add(inertia, name, number(link.inertia))


def _joint(model: tree.Element, joint: Joint) -> None:
    expressed = EXPRESSED if joint.control == "force" else EXPRESSED | CONTROLLED
    for line in joint.inexpressible(expressed):
        comment(model, line)
    element = add(model, "joint", name=joint.name, type="revolute" if joint.rotational else "prismatic")
    add(element, "parent", "world")
    add(element, "child", f"{joint.name}_link")
    axis = add(element, "axis")
    add(axis, "xyz", vector(link_of(joint).axis))
    if joint.effort_limit < math.inf:
        add(add(axis, "limit"), "effort", number(joint.effort_limit))
    dynamics = add(axis, "dynamics")
    for word, value in (
        ("damping", joint.damping),
        ("friction", joint.friction),
        ("spring_reference", joint.spring_reference),
        ("spring_stiffness", joint.stiffness),
    ):
        add(dynamics, word, number(value))


def _plugin(model: tree.Element, joint: Joint) -> None:
    filename, name = SYSTEMS[joint.control]
    plugin = add(model, "plugin", filename=filename, name=name)
    add(plugin, "joint_name", joint.name)
    if joint.control == "velocity":
        add(plugin, "use_force_commands", "true")
        add(plugin, "p_gain", number(joint.gain * joint.velocity_gain))
    elif joint.control == "position":
        comment(plugin, "d_gain acts on the rate of the error, the identified gain on the speed alone")
        add(plugin, "p_gain", number(joint.gain * joint.position_gain))
        add(plugin, "i_gain", number(0.0))
        add(plugin, "d_gain", number(joint.gain * joint.velocity_gain))
