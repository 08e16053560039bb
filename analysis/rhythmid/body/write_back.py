"""A machine back into the body's own format: MJCF or URDF with the identified values in place.

MJCF has masses, rotors' inertias, viscous damping and dry friction (a soft constraint there, a smooth law here); URDF has masses and the
two losses. What a file cannot express is told by name.
"""

import xml.etree.ElementTree as tree
from pathlib import Path
from typing import Any

from rhythmid.body.machine import Machine
from rhythmid.body.mujoco_body import FIXED, mujoco
from rhythmid.errors import InputError
from rhythmid.output import write_text

MJCF, URDF = ".xml", ".urdf"
LOSSES = ("viscous_damper", "coulomb_friction")


def save_machine(machine: Machine, path: Path) -> tuple[str, ...]:
    """Write a machine as its suffix says: .yaml, .xml (MJCF) or .urdf. Returns the elements that the file cannot express.

    Raises InputError where a body that is no URDF is to become one, or the place is not writable.
    """
    if path.suffix == MJCF:
        write_text(path, mjcf_of(machine))
    elif path.suffix == URDF:
        write_text(path, urdf_of(machine))
    else:
        machine.save(path)
        return ()
    return tuple(
        f"{joint}.{term.label}"
        for joint, model in machine.paths.items()
        for term in model.terms
        if term.label not in LOSSES
    )


def losses_of(machine: Machine, joint: str) -> tuple[float, float]:
    """Viscous damping and dry friction of a joint's path."""
    terms = {term.label: term for term in machine.paths[joint].terms}
    damping, friction = (terms.get(name) for name in LOSSES)
    return (
        0.0 if damping is None else damping.values["damping"].value,
        0.0 if friction is None else friction.values["force"].value,
    )


def mjcf_of(machine: Machine) -> str:
    """The body's file with the machine's values, as MJCF."""
    mj = mujoco()
    spec = mj.MjSpec.from_file(str(machine.body.path))
    model = machine.body.model
    for link, number in machine.body.links.items():
        body = spec.body(link)
        body.explicitinertial = True
        body.mass = float(model.body_mass[number])
        body.ipos, body.iquat = model.body_ipos[number], model.body_iquat[number]
        body.inertia = model.body_inertia[number]
    for name, one in machine.body.joints.items():
        joint = spec.joint(name)
        joint.armature = float(model.dof_armature[one.velocity])
        if name in machine.paths:
            damping, friction = losses_of(machine, name)
            _set(joint, "damping", damping)
            joint.frictionloss = friction
    if machine.body.base == FIXED:
        floating = [one for one in spec.joints if one.type == mj.mjtJoint.mjJNT_FREE]
        for one in (*floating, *(spec.keys if floating else ())):
            spec.delete(one)
    spec.compile()
    return str(spec.to_xml())


def _set(joint: Any, name: str, value: float) -> None:
    """Set a coefficient that newer versions of MuJoCo hold as the first of a polynomial's."""
    if hasattr(getattr(joint, name), "__len__"):
        getattr(joint, name)[0] = value
    else:
        setattr(joint, name, value)


def urdf_of(machine: Machine) -> str:
    """The body's URDF with the machine's values. Raises InputError where the body's file is no URDF."""
    if machine.kind != "urdf":
        raise InputError(
            f"{machine.body.path}: is no URDF, so none can be written from it; write .xml (MJCF)"
        )
    document = tree.parse(machine.body.path)
    known = machine.body.parameters
    for link in document.iter("link"):
        mass = link.find("inertial/mass")
        name = f"{link.get('name')}.mass"
        if mass is None or name not in known:
            continue
        share = known[name] / float(mass.get("value", "1"))
        mass.set("value", repr(known[name]))
        inertia = link.find("inertial/inertia")
        for key, value in (inertia.attrib if inertia is not None else {}).items():
            assert inertia is not None
            inertia.set(key, repr(share * float(value)))
    for joint in document.iter("joint"):
        if (name := str(joint.get("name"))) not in machine.paths:
            continue
        dynamics = joint.find("dynamics")
        if dynamics is None:
            dynamics = tree.SubElement(joint, "dynamics")
        for key, value in zip(("damping", "friction"), losses_of(machine, name)):
            dynamics.set(key, repr(value))
    return tree.tostring(document.getroot(), encoding="unicode") + "\n"
