"""Isaac Lab: actuator configurations with PD gains, friction, armature and a delay in physics steps.

Friction and viscous friction are efforts from Isaac Sim 5.0 on; in older versions friction is a ratio without unit.
"""

import math
from collections.abc import Sequence

from rhythmid.export.joint import Joint, number

EXPRESSED = frozenset(
    (
        "inertia", "damping", "friction", "static_friction", "position_gain", "velocity_gain", "command_delay", "effort_limit",
    )
)  # fmt: skip
PHYSICS_STEP = 0.005  # [s]; the step of most of Isaac Lab's own environments


def text(joints: Sequence[Joint], source: str) -> str:
    """A Python module with ACTUATORS, by joint, for ArticulationCfg(actuators=ACTUATORS)."""
    lines = [
        f"# Actuators identified by rhythmid: {source}. Friction as an effort needs Isaac Sim 5.0 or later.",
        "",
        "from isaaclab.actuators import DelayedPDActuatorCfg",
        "",
        f"PHYSICS_STEP = {PHYSICS_STEP!r}  # s; set it to your simulation's dt",
        "# Inertia of each link about its joint's axis as the robot's USD has it; until you set it, all that was identified",
        "LINK_INERTIA = {",
        *(
            f'    "{joint.name}": {number(joint.inertia)},  # {joint.unit("inertia")}, link and rotor together'
            for joint in joints
        ),
        "}",
        "",
        "ACTUATORS = {",
    ]
    for joint in joints:
        lines += _actuator(joint)
    return "\n".join([*lines, "}", ""])


def _actuator(joint: Joint) -> list[str]:
    # in a controller's loop the gain is part of the PD gains, and a dead time before the law is the command's
    looped = joint.control != "force"
    expressed = EXPRESSED | ({"gain"} if looped else {"actuator_delay"})
    delay = joint.command_delay + (0.0 if looped else joint.actuator_delay)
    steps = f"round({number(delay)} / PHYSICS_STEP)"
    arguments = {
        "joint_names_expr": f'["{joint.name}"]',
        "stiffness": number(joint.gain * joint.position_gain),
        "damping": number(joint.gain * joint.velocity_gain),
        **({"effort_limit": number(joint.effort_limit)} if joint.effort_limit < math.inf else {}),
        "armature": f'{number(joint.inertia)} - LINK_INERTIA["{joint.name}"]',
        "friction": number(max(joint.friction, joint.static_friction)),
        "dynamic_friction": number(joint.friction),
        "viscous_friction": number(joint.damping),
        "min_delay": steps,
        "max_delay": steps,
    }
    return [
        *(f"    # {line}" for line in joint.inexpressible(expressed)),
        f'    "{joint.name}": DelayedPDActuatorCfg(',
        *(f"        {name}={value}," for name, value in arguments.items()),
        "    ),",
    ]
