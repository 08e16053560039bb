"""URDF: links, and joints with `dynamics` (damping, friction) and an effort limit; it cannot describe an actuator further."""

import math
import xml.etree.ElementTree as tree
from collections.abc import Sequence

from rhythmid.export.joint import Joint, number
from rhythmid.export.link import link_of, world_gravity
from rhythmid.export.xml_text import add, comment, document, vector

EXPRESSED = frozenset(
    ("inertia", "gravity", "weight_moment", "hanging_position", "damping", "friction", "effort_limit")
)
NO_LIMIT = 1e6  # limit of travel, effort and speed if none is known: the format requires one


def text(joints: Sequence[Joint], source: str) -> str:
    """The URDF of joints. Raises InputError where they ask for different gravities."""
    root = tree.Element("robot", name=joints[0].name)
    comment(root, f"identified by rhythmid: {source}")
    comment(root, f"the world's gravity is {world_gravity(joints):.6g} m/s^2 along -z")
    add(root, "link", name="base")
    for joint in joints:
        _link(root, joint)
        _joint(root, joint)
    return document(root)


def _link(root: tree.Element, joint: Joint) -> None:
    link = link_of(joint)
    inertial = add(add(root, "link", name=f"{joint.name}_link"), "inertial")
    add(inertial, "origin", xyz=vector(link.centre), rpy="0 0 0")
    add(inertial, "mass", value=number(link.mass))
    diagonal = number(link.inertia)
    add(inertial, "inertia", ixx=diagonal, ixy="0", ixz="0", iyy=diagonal, iyz="0", izz=diagonal)


def _joint(root: tree.Element, joint: Joint) -> None:
    for line in joint.inexpressible(EXPRESSED):
        comment(root, line)
    kind = "continuous" if joint.rotational else "prismatic"
    element = add(root, "joint", name=joint.name, type=kind)
    add(element, "parent", link="base")
    add(element, "child", link=f"{joint.name}_link")
    add(element, "axis", xyz=vector(link_of(joint).axis))
    effort = joint.effort_limit if joint.effort_limit < math.inf else NO_LIMIT
    travel = {} if joint.rotational else {"lower": number(-NO_LIMIT), "upper": number(NO_LIMIT)}
    if travel or joint.effort_limit < math.inf:
        add(element, "limit", effort=number(effort), velocity=number(NO_LIMIT), **travel)
    add(element, "dynamics", damping=number(joint.damping), friction=number(joint.friction))
