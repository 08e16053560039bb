"""MuJoCo: an MJCF model with one body per joint, which can be loaded directly.

Delays need MuJoCo 3.5, nonlinear springs and dampers 4.0; they are written only where the joint has them.
`frictionloss` is a soft constraint: it creeps where an identified law sticks.
"""

import math
import xml.etree.ElementTree as tree
from collections.abc import Sequence

from rhythmid.body.soft_constraint import SoftConstraint
from rhythmid.export.joint import Joint, number
from rhythmid.export.link import link_of, world_gravity
from rhythmid.export.xml_text import add, comment, document, vector

TIMESTEP = 0.001  # [s]; the default sample period of experiments
EXPRESSED = frozenset(
    (
        "inertia", "gravity", "weight_moment", "hanging_position", "damping", "quadratic_damping", "friction", "stiffness",
        "spring_reference", "quadratic_stiffness", "cubic_stiffness", "constant_force", "position_gain", "velocity_gain",
        "command_delay", "command_lag", "gain", "actuator_lag", "actuator_delay", "effort_limit", "measurement_delay",
        "friction_regularisation", "friction_lead",
    )
)  # fmt: skip


def text(joints: Sequence[Joint], source: str) -> str:
    """The MJCF file of joints. Raises InputError where they ask for different gravities."""
    root = tree.Element("mujoco", model=joints[0].name)
    comment(root, f"identified by rhythmid: {source}")
    add(root, "compiler", angle="radian")
    gravity = vector((0.0, 0.0, -world_gravity(joints)))
    add(root, "option", timestep=number(TIMESTEP), integrator="RK4", gravity=gravity)
    world, actuators, sensors = (add(root, name) for name in ("worldbody", "actuator", "sensor"))
    for joint in joints:
        _body(world, joint)
        add(actuators, "general", **actuator(joint))
        add(
            sensors,
            "jointpos",
            name=f"{joint.name}_position",
            joint=joint.name,
            **_delay(joint.measurement_delay),
        )
    return document(root)  # fmt: skip


def _body(world: tree.Element, joint: Joint) -> None:
    link = link_of(joint)
    body = add(world, "body", name=f"{joint.name}_link")
    comment(
        body,
        f"inertia {joint.inertia:.6g} {joint.unit('inertia')} is link and rotor together: in a robot whose link has an inertia of "
        "its own, write the difference as armature of the joint",
    )
    if joint.friction and not joint.friction_regularisation:
        comment(
            body,
            "frictionloss is a soft constraint: at rest it creeps, where the identified friction holds or turns smoothly",
        )
    for line in joint.inexpressible(expressed(joint)):
        comment(body, line)
    attributes = {
        "name": joint.name,
        "type": "hinge" if joint.rotational else "slide",
        "axis": vector(link.axis),
        "armature": number(0.0),
        "damping": polynomial(joint.damping, joint.quadratic_damping),
        **friction(joint, 1.0 / joint.inertia),
        "stiffness": polynomial(joint.stiffness, joint.quadratic_stiffness, joint.cubic_stiffness),
        "springref": number(joint.spring_reference),
    }
    add(body, "joint", **attributes)
    inertia = vector((link.inertia,) * 3)
    add(body, "inertial", pos=vector(link.centre), mass=number(link.mass), diaginertia=inertia)


def friction(joint: Joint, weight: float, step: float = TIMESTEP) -> dict[str, str]:
    """Attributes of a joint's dry friction; `weight` is its inverse inertia [1/kg or 1/(kg*m^2)] in MuJoCo's reference pose."""
    words = {"frictionloss": number(joint.friction)}
    if joint.friction_regularisation:
        soft = SoftConstraint(joint.friction, joint.friction_regularisation, joint.friction_lead)
        reference, impedance = soft.solver(weight, step)
        words |= {"solreffriction": vector(reference), "solimpfriction": vector(impedance)}
    return words


def polynomial(linear: float, *higher: float) -> str:
    """Only the linear coefficient if the others are zero, because older versions read only one."""
    return vector((linear, *higher)) if any(higher) else number(linear)


def expressed(joint: Joint) -> frozenset[str]:
    """The part of this joint that MJCF can express: an actuator has one low-pass filter and one delay, both before its control law."""
    inside = {"actuator_lag", "actuator_delay"} if joint.control != "force" else set()
    lags = {"actuator_lag"} if joint.command_lag else set()
    constant = {"constant_force"} if joint.effort_limit < math.inf else set()
    return EXPRESSED - inside - lags - constant


def actuator(joint: Joint, step: float = TIMESTEP) -> dict[str, str]:
    """Attributes of the `general` actuator of a joint, in a model with this time step [s]."""
    words = expressed(joint)
    attributes = {"name": joint.name, "joint": joint.name}
    bias = joint.constant_force if "constant_force" in words else 0.0
    gain, position, velocity = joint.gain, 0.0, 0.0
    if joint.control == "position":
        gain, position = joint.gain * joint.position_gain, -joint.gain * joint.position_gain
        velocity = -joint.gain * joint.velocity_gain
    elif joint.control == "velocity":
        gain, velocity = joint.gain * joint.velocity_gain, -joint.gain * joint.velocity_gain
    attributes |= {"gaintype": "fixed", "gainprm": number(gain)}
    if bias or position or velocity:
        attributes |= {"biastype": "affine", "biasprm": vector((bias, position, velocity))}
    lag = joint.command_lag or (joint.actuator_lag if "actuator_lag" in words else 0.0)
    if lag:
        attributes |= {"dyntype": "filterexact", "dynprm": number(lag)}
    if joint.effort_limit < math.inf:
        attributes |= {"forcerange": vector((-joint.effort_limit, joint.effort_limit))}
    dead_time = joint.actuator_delay if "actuator_delay" in words else 0.0
    return attributes | _delay(joint.command_delay + dead_time, step)


def _delay(delay: float, step: float = TIMESTEP) -> dict[str, str]:
    """A delay and the number of samples that it keeps; none of a joint without one."""
    if not delay:
        return {}
    samples = math.ceil(round(delay / step, 9)) + 1
    return {"delay": number(delay), "nsample": str(samples), "interp": "linear"}
