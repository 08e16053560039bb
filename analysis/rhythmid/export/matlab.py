"""MATLAB: a script that creates a struct array `joint` with all numbers, and a state space with delays of each joint's linear part."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.export.joint import Joint, number

NONLINEAR = frozenset(
    (
        "quadratic_damping",
        "friction",
        "friction_regularisation",
        "friction_lead",
        "static_friction",
        "quadratic_stiffness",
        "cubic_stiffness",
        "effort_limit",
    )
)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearPart:
    """dz/dt = A z + B u(t - input_delay), position(t) = equilibrium + z_1(t - output_delay).

    `states` names the n states z: position from the equilibrium and velocity, then lagged command and actuator force where there are
    lags. A has the shape (n, n), B (n, 1). A link's weight is linearised about its rest position.
    """

    states: tuple[str, ...]
    a: Array
    b: Array
    equilibrium: float
    input_delay: float
    output_delay: float


def linear_part(joint: Joint) -> LinearPart:
    """The joint without its nonlinear effects, and without a dead time inside a controller's loop."""
    lags = {"command": joint.command_lag, "force": joint.actuator_lag}
    states = ("position", "velocity", *(name for name, lag in lags.items() if lag))
    signals = (*states, "input")
    row = {name: np.eye(len(signals))[place] for place, name in enumerate(signals)}
    nothing = np.zeros(len(signals))
    command = row.get("command", row["input"])
    law = {
        "force": command,
        "position": joint.position_gain * (command - row["position"]) - joint.velocity_gain * row["velocity"],
        "velocity": joint.velocity_gain * (command - row["velocity"]),
    }[joint.control]
    asked = joint.gain * law
    stiffness = joint.stiffness + joint.weight_moment
    passive = -stiffness * row["position"] - joint.damping * row["velocity"]
    rates = {
        "position": row["velocity"],
        "velocity": (row.get("force", asked) + passive) / joint.inertia,
        "command": (row["input"] - command) / (joint.command_lag or 1.0),
        "force": (asked - row.get("force", nothing)) / (joint.actuator_lag or 1.0),
    }
    whole = np.array([rates[name] for name in states])
    held = stiffness + (joint.gain * joint.position_gain if joint.control == "position" else 0.0)
    load = (
        joint.stiffness * joint.spring_reference
        + joint.weight_moment * joint.hanging_position
        + joint.constant_force
        - joint.inertia * joint.gravity
    )
    dead_time = joint.actuator_delay if joint.control == "force" else 0.0
    return LinearPart(
        states,
        whole[:, :-1],
        whole[:, -1:],
        load / held if held else 0.0,
        joint.command_delay + dead_time,
        joint.measurement_delay,
    )


def text(joints: Sequence[Joint], source: str) -> str:
    """The script; `ss` needs the Control System Toolbox."""
    lines = [f"% identified by rhythmid: {source}"]
    for place, joint in enumerate(joints, 1):
        lines += ["", *_struct(f"joint({place})", joint)]
    return "\n".join([*lines, ""])


def _struct(name: str, joint: Joint) -> list[str]:
    part = linear_part(joint)
    beyond = [one.name for one in joint.quantities if one.name in NONLINEAR]
    if joint.control != "force" and joint.actuator_delay:
        beyond.append("actuator_delay")
    states = ", ".join(f"'{state}'" for state in part.states)
    return [
        *(f"% {remark}" for remark in joint.remarks),
        f"{name}.name = '{joint.name}';",
        f"{name}.control = '{joint.control}';  % what the command is",
        *(
            f"{name}.{one.name} = {number(one.value)};  % {one.unit}, {one.meaning}"
            for one in joint.quantities
        ),
        *([f"% not expressed in the state space, which is linear: {', '.join(beyond)}"] if beyond else []),
        *(["% the link's weight is linearised where it hangs at rest"] if joint.weight_moment else []),
        f"{name}.equilibrium = {number(part.equilibrium)};  % {joint.unit('spring_reference')}, position at rest without command",
        f"{name}.A = {_matrix(part.a)};",
        f"{name}.B = {_matrix(part.b)};",
        f"{name}.C = {_matrix(np.eye(1, len(part.states)))};",
        f"{name}.D = 0;",
        f"{name}.sys = ss({name}.A, {name}.B, {name}.C, {name}.D, 'InputDelay', {number(part.input_delay)}, "
        f"'OutputDelay', {number(part.output_delay)}, 'StateName', {{{states}}}, 'InputName', 'command', 'OutputName', 'position');",
    ]


def _matrix(values: Array) -> str:
    return "[" + "; ".join(" ".join(number(one) for one in row) for row in values) + "]"
