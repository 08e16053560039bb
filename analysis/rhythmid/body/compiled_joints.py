"""Joints of a compiled MuJoCo model, with their damping and dry friction."""

from pathlib import Path
from typing import Any

from rhythmid.body.body import Joint, Passive
from rhythmid.body.robot_file import mujoco
from rhythmid.errors import InputError


def joints_of(model: Any, path: Path) -> dict[str, Joint]:
    """Joints with one degree of freedom. Raises InputError for a ball joint, and where there is none."""
    mj, found = mujoco(), {}
    for number in range(model.njnt):
        kind, name = model.jnt_type[number], model.joint(number).name
        if kind == mj.mjtJoint.mjJNT_BALL:
            raise InputError(f"{path}: the ball joint {name!r} cannot be described; write it as three hinges")
        if kind != mj.mjtJoint.mjJNT_FREE:
            found[name] = Joint(
                name, kind == mj.mjtJoint.mjJNT_HINGE, int(model.jnt_qposadr[number]), int(model.jnt_dofadr[number])
            )  # fmt: skip
    if not found:
        raise InputError(f"{path}: has no hinge and no slide")
    if "" in found:
        raise InputError(f"{path}: has a joint without a name")
    return found


def passive_of(model: Any) -> dict[str, Passive]:
    """Damping and dry friction of the joints in the file."""
    return {
        model.joint(number).name: Passive(float(model.dof_damping[dof]), float(model.dof_frictionloss[dof]))
        for number, dof in enumerate(model.jnt_dofadr)
    }
