"""Nav2: the delays of a base's axis as the MPPI controller's `model_delay_vx` or `model_delay_wz`.

The controller shifts its predicted speeds by a whole number of `model_dt`: a pure delay without a lag. At frequencies well below
1 / (2 pi tau) a lag tau acts as a delay of tau, so it is added.
"""

from collections.abc import Sequence

from rhythmid.errors import InputError
from rhythmid.export.joint import Joint, number

EXPRESSED = frozenset(("command_delay", "command_lag", "actuator_delay", "actuator_lag"))


def text(joints: Sequence[Joint], source: str) -> str:
    """Parameters of the controller server. Raises InputError if two joints refer to the same axis."""
    axes = ["wz" if joint.rotational else "vx" for joint in joints]
    if len(set(axes)) < len(axes):
        raise InputError("--to nav2: takes at most one prismatic (vx) and one revolute (wz) axis of a base")
    lines = [
        f"# identified by rhythmid: {source}",
        "# MPPI controller of Nav2 Lyrical and later; the controller rounds a delay to whole steps of model_dt",
    ]
    for joint, axis in zip(joints, axes, strict=True):
        lines.append(
            f"# {joint.name}: set model_delay_vy instead of vx for a sideways axis"
            if axis == "vx"
            else f"# {joint.name}"
        )
        if lags := joint.command_lag + joint.actuator_lag:
            lines.append(
                f"# {lags:.6g} s of its delay stand for lags, which the controller's model does not have"
            )
        if joint.control != "velocity":
            lines.append(f"# its command is a {joint.control}, Nav2's a speed: add what a speed loop takes")
        lines += [f"# {line}" for line in joint.inexpressible(EXPRESSED)]
    lines += [
        "controller_server:",
        "  ros__parameters:",
        "    FollowPath:",
        '      plugin: "nav2_mppi_controller::MPPIController"',
    ]
    for joint, axis in zip(joints, axes, strict=True):
        lines.append(f"      model_delay_{axis}: {number(_delay(joint))}  # s")
    return "\n".join([*lines, ""])


def _delay(joint: Joint) -> float:
    return joint.command_delay + joint.command_lag + joint.actuator_delay + joint.actuator_lag
