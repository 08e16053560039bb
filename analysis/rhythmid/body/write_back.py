"""Writes a machine in the body's own format: MJCF or URDF with the identified values.

MJCF has masses, rotors' inertias, viscous damping and dry friction (a soft constraint there; here a smooth law, or
that constraint). It has an actuator for each path with the controller's gains, a lag and a delay. URDF has masses,
inertias and the two losses. Effects that a file cannot express are reported by name. The MJCF also contains the
paths themselves: `rhythmid.mujoco.apply` makes them act in a user's own simulation loop.
"""

import os
import xml.etree.ElementTree as tree
from collections.abc import Collection, Mapping, Sequence
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhythmid.body.embedded import NAME, text_of
from rhythmid.body.inertial_parameter import MASS, PAYLOAD
from rhythmid.body.link_inertia import Principal, about_centre, point_mass
from rhythmid.body.live_source import generate_live, numbers_of, rows_of
from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import MujocoBody
from rhythmid.body.robot_file import read_robot
from rhythmid.errors import InputError
from rhythmid.export import mujoco as mjcf
from rhythmid.export.from_model import joint_of
from rhythmid.export.joint import Joint
from rhythmid.output import write_text

Array = NDArray[np.float64]
MJCF, URDF = ".xml", ".urdf"
ROUNDING = 1e-12  # relative rounding error of a link's inertia
# [m] radius of gyration of a payload in a URDF, in which an inertia cannot be zero
LEAST_GYRATION_RADIUS = 1e-3
LOSSES = ("viscous_damper", "coulomb_friction", "soft_constraint_friction")
# of an actuator; further attributes of its class are overridden
KEPT = ("name", "class", "group", "forcerange", "forcelimited")
PLAIN = {"ctrllimited": "false", "dyntype": "none", "gaintype": "fixed", "biastype": "none", "gear": "1"}
WRITTEN = {"ipos": "pos", "iquat": "quat", "inertia": "diaginertia"}  # of an inertial element
IN_PLACE = frozenset(
    (
        "inertia", "damping", "friction", "position_gain", "velocity_gain", "command_delay", "command_lag", "gain", "actuator_lag",
        "actuator_delay", "effort_limit", "constant_force", "friction_regularisation", "friction_lead",
    )
)  # fmt: skip


def save_machine(machine: Machine, path: Path) -> tuple[str, ...]:
    """Write a machine in the format of its suffix: .yaml, .xml (MJCF) or .urdf. Returns in words what the file
    cannot express.

    Raises InputError where a body from another format is to be written as URDF, or the location is not writable.
    """
    if path.suffix == MJCF:
        write_text(path, mjcf_of(machine, path.parent))
        return tuple(f"{joint}: {line}" for joint in machine.joints for line in unexpressed(machine, joint))
    if path.suffix == URDF:
        write_text(path, urdf_of(machine, path.parent))
        own = (f"{one}.armature" for one in machine.joints if machine.body.parameters[f"{one}.armature"])
        mounted = ("body.gravity: a URDF has no place for it",) if machine.body.mounted else ()
        return tuple(f"not expressed: {one}" for one in (*own, *mounted, *_beyond_losses(machine)))
    machine.save(path)
    return ()


def _beyond_losses(machine: Machine) -> list[str]:
    return [
        f"{joint}.{term.label}"
        for joint, model in machine.paths.items()
        for term in model.terms
        if term.label not in LOSSES
    ]


def unexpressed(machine: Machine, joint: str) -> tuple[str, ...]:
    """Effects in a joint's path that MJCF cannot express, or only approximately."""
    described = _described(machine, joint)
    return described.inexpressible(IN_PLACE & mjcf.expressed(described))


def _described(machine: Machine, joint: str) -> Joint:
    return joint_of(machine.paths[joint], "joint")  # the name is the file's, with any characters


def losses_of(machine: Machine, joint: str) -> tuple[float, float]:
    """Viscous damping and dry friction of a joint's path."""
    described = _described(machine, joint)
    return described.damping, described.friction


def mjcf_of(machine: Machine, folder: Path) -> str:
    """The body's file with the machine's values, as MJCF for the folder `folder`."""
    known = machine.body
    spec = read_robot(known.path, known.base, known.contacts, known.hold).spec
    model = machine.body.model
    for link, number in machine.body.links.items():
        body = spec.body(link)
        body.explicitinertial, body.fullinertia = True, [float("nan")] * 6
        body.mass = float(model.body_mass[number])
        body.ipos, body.iquat = model.body_ipos[number], model.body_iquat[number]
        body.inertia = model.body_inertia[number]
    step = min(float(spec.option.timestep), machine.body.step)
    spec.compile()
    root = tree.fromstring(spec.to_xml())
    folders = {"meshdir": [*spec.meshes, *spec.hfields], "texturedir": spec.textures}
    for kind in (one for one, files in folders.items() if files):  # relative to the written file
        known = machine.body.path.resolve().parent / getattr(spec, kind)
        _section(root, "compiler").set(kind, os.path.relpath(known, folder.resolve()))
    _values(root, machine, step)
    if not machine.body.contacts:
        _section(_section(root, "option"), "flag").set("contact", "disable")
    if machine.body.mounted:
        option = _section(root, "option")
        option.set("gravity", " ".join(repr(float(one)) for one in machine.body.gravity))
    _actuators(root, machine, step)
    _embed(root, machine, step)
    tree.indent(root)
    return tree.tostring(root, encoding="unicode") + "\n"


def _values(root: tree.Element, machine: Machine, step: float) -> None:
    """Set inertials and joints with all digits of the machine's values; MuJoCo itself writes fewer."""
    model, body = machine.body.model, machine.body
    world = _section(root, "worldbody")
    for link in (one for one in world.iter("body") if one.get("name") in body.links):
        number, own = body.links[str(link.get("name"))], _section(link, "inertial")
        own.attrib.clear()
        own.set("mass", repr(float(model.body_mass[number])))
        for name in ("ipos", "iquat", "inertia"):
            values = getattr(model, f"body_{name}")[number]
            own.set(WRITTEN[name], " ".join(repr(float(value)) for value in values))
    for joint in (one for one in world.iter("joint") if one.get("name") in body.joints):
        name = str(joint.get("name"))
        dof = body.joints[name].velocity
        joint.set("armature", repr(float(model.dof_armature[dof])))
        # a spring given by its time constant would depend on the identified inertia
        spring = float(model.jnt_stiffness[model.joint(name).id])
        joint.set(
            "stiffness", mjcf.polynomial(spring, *_higher(model, "jnt_stiffnesspoly", model.joint(name).id))
        )
        if name in machine.paths:
            weight = float(model.dof_invweight0[dof])
            described = _described(machine, name)
            joint.set("damping", mjcf.polynomial(described.damping, *_higher(model, "dof_dampingpoly", dof)))
            for word, value in mjcf.friction(described, weight, step).items():
                joint.set(word, value)


def _higher(model: Any, coefficients: str, place: int) -> list[float]:
    """The nonlinear coefficients of a spring or a damper, which remain in the body; MuJoCo before 4.0 has none."""
    return [float(one) for one in getattr(model, coefficients, {place: ()})[place]]


def _section(root: tree.Element, name: str) -> tree.Element:
    found = root.find(name)
    return tree.SubElement(root, name) if found is None else found


def _actuators(root: tree.Element, machine: Machine, step: float) -> None:
    """One actuator for each path: the joint's first one, or a new one. Further actuators of the joint remain in
    `ctrl`, without effect."""
    section = _section(root, "actuator")
    for joint in machine.joints:
        described = _described(machine, joint)
        own = [one for one in section if one.get("joint") == joint]
        if not own:
            own = [tree.SubElement(section, "general", name=joint)]
        for idle in own[1:]:
            _become(idle, {"joint": joint, "gainprm": "0"})
        _become(own[0], {**mjcf.actuator(described, step), "joint": joint})
        for line in unexpressed(machine, joint):
            section.append(tree.Comment(f" {joint}: {line} ".replace("--", "-")))


def _become(actuator: tree.Element, attributes: dict[str, str]) -> None:
    """Convert to a general actuator with these attributes, keeping the attributes common to all actuators."""
    kept = {name: value for name, value in actuator.attrib.items() if name in KEPT}
    attributes = {name: value for name, value in attributes.items() if name != "name"}
    actuator.tag = "general"
    actuator.attrib.clear()
    actuator.attrib.update({**kept, **PLAIN, **attributes})


def _embed(root: tree.Element, machine: Machine, step: float) -> None:
    """Add the paths as a text of the file, with space for the variables that persist between steps."""
    _, layout = generate_live(machine.paths)
    size = _section(root, "size")
    needed = numbers_of(layout, rows_of(machine.paths, step))
    size.set("nuserdata", str(max(needed, int(size.get("nuserdata", "0")))))
    custom = _section(root, "custom")
    for one in [one for one in custom if one.get("name") == NAME]:
        custom.remove(one)
    tree.SubElement(custom, "text", name=NAME, data=text_of(machine.paths))


def _carrier(link: str, parents: Mapping[str, str], moving: Collection[str]) -> str:
    """The moving link to which a link of a URDF belongs: itself, or the nearest one through fixed joints."""
    while link not in moving and link in parents:
        link = parents[link]
    return link


def _fixed_to(root: tree.Element, held: Collection[str]) -> dict[str, str]:
    """The link to which each link of a URDF is fixed, for those that do not move relative to it."""
    ends = [
        [one.get("link", "") for end in ("child", "parent") for one in joint.findall(end)]
        for joint in root.iter("joint")
        if joint.get("type") == "fixed" or joint.get("name") in held
    ]
    return dict(ends)


def _scale(link: tree.Element, share: float) -> None:
    """Scale mass and inertia of a link of a URDF."""
    if (mass := link.find("inertial/mass")) is not None:
        mass.set("value", repr(share * float(mass.get("value", "1"))))
    if (inertia := link.find("inertial/inertia")) is not None:
        for key, value in inertia.attrib.items():
            inertia.set(key, repr(share * float(value)))


def _replace(link: tree.Element, own: Principal | None) -> None:
    """Give a link of a URDF this inertia, or none: what is fixed to a link has its part in the inertia of that."""
    for known in link.findall("inertial"):
        link.remove(known)
    if own is None:
        return
    inertial = tree.SubElement(link, "inertial")
    mass, centre, about = about_centre(own.ten)
    tree.SubElement(inertial, "origin", xyz=" ".join(repr(float(one)) for one in centre), rpy="0 0 0")
    tree.SubElement(inertial, "mass", value=repr(mass))
    words = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    tree.SubElement(
        inertial, "inertia", {word: repr(float(one)) for word, one in zip(words, about, strict=True)}
    )


def _add_inertia(link: tree.Element, ten: Array) -> None:
    """Add the first moment and the moments of inertia among ten parameters (10,) to a link of a URDF, which includes the
    inertia of everything fixed to it. Its mass stays."""
    inertial = _section(link, "inertial")
    inertia, origin = _section(inertial, "inertia"), _section(inertial, "origin")
    mass = float(_section(inertial, "mass").attrib.setdefault("value", "0"))
    centre, turn = (
        np.array([float(one) for one in origin.get(key, "0 0 0").split()]) for key in ("xyz", "rpy")
    )
    moved = centre + ten[1:4] / mass if np.any(ten[1:4]) else centre
    axes = Rotation.from_euler("xyz", turn).as_matrix()
    xx, yy, zz, xy, xz, yz = ten[4:] + mass * (point_mass(centre) - point_mass(moved))[4:]
    more = axes.T @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ axes
    origin.set("xyz", " ".join(repr(float(one)) for one in moved))
    for (row, first), (column, second) in combinations_with_replacement(enumerate("xyz"), 2):
        key = f"i{first}{second}"
        inertia.set(key, repr(float(inertia.get(key, "0")) + float(more[row, column])))


def _attach(root: tree.Element, link: str, mass: float, place: Sequence[float]) -> None:
    """Fix a ball of this mass to a link of a URDF, at a position in its frame."""
    own = f"{link}_{PAYLOAD}"
    ball = tree.SubElement(tree.SubElement(root, "link", name=own), "inertial")
    tree.SubElement(ball, "mass", value=repr(mass))
    inertia = repr(mass * LEAST_GYRATION_RADIUS**2)
    sides = {"ixx": inertia, "iyy": inertia, "izz": inertia, "ixy": "0", "ixz": "0", "iyz": "0"}
    tree.SubElement(ball, "inertia", sides)
    joint = tree.SubElement(root, "joint", name=f"{own}_joint", type="fixed")
    tree.SubElement(joint, "parent", link=link)
    tree.SubElement(joint, "child", link=own)
    tree.SubElement(joint, "origin", xyz=" ".join(repr(float(one)) for one in place))


def _beyond_mass(body: MujocoBody, given: MujocoBody, link: str) -> Array:
    """Difference of the ten parameters (10,) of a link from those of the file for another mass of the same shape."""
    now, before = body.own(link), given.own(link)
    return now.ten - before.ten * (now.mass / before.mass)


def urdf_of(machine: Machine, folder: Path) -> str:
    """The body's URDF with the machine's values, for the folder `folder`. Raises InputError where the body's file
    is no URDF."""
    if machine.kind != "urdf":
        raise InputError(
            f"{machine.body.path}: is no URDF, so none can be written from it; write .xml (MJCF)"
        )
    document = tree.parse(machine.body.path)
    body = machine.body
    known = body.parameters
    given = MujocoBody.load(body.path, contacts=False, hold=body.hold)
    fixed = _fixed_to(document.getroot(), body.hold)
    for link in document.iter("link"):
        carrier = _carrier(str(link.get("name")), fixed, machine.body.links)
        name = f"{carrier}.{MASS}"
        if carrier in body.replaced:
            _replace(link, body.own(carrier) if link.get("name") == carrier else None)
        elif name in known:
            _scale(link, known[name] / given.parameters[name])
    own = [one for one in document.iter("link") if one.get("name") in body.links]
    for link in (one for one in own if one.get("name") not in body.replaced):
        more = _beyond_mass(body, given, str(link.get("name")))
        if np.abs(more).max() > ROUNDING * np.abs(given.inertial(str(link.get("name")))).max():
            _add_inertia(link, more)
    for link, place in body.ends.items():
        if payload := known[f"{link}.{PAYLOAD}"]:
            _attach(document.getroot(), link, payload, place.tolist())
    for mesh in document.iter("mesh"):  # relative to the written file
        file = mesh.get("filename", "")
        if file and "://" not in file:
            known_at = machine.body.path.resolve().parent / file
            mesh.set("filename", os.path.relpath(known_at, folder.resolve()))
    for joint in document.iter("joint"):
        if (name := str(joint.get("name"))) not in machine.paths:
            continue
        dynamics = joint.find("dynamics")
        if dynamics is None:
            dynamics = tree.SubElement(joint, "dynamics")
        for key, value in zip(("damping", "friction"), losses_of(machine, name)):
            dynamics.set(key, repr(value))
    return tree.tostring(document.getroot(), encoding="unicode") + "\n"
