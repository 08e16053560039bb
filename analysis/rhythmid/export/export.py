"""Joints in the format of a target: MuJoCo, URDF, SDF, Isaac Lab, MATLAB, CSV or Nav2."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Literal, get_args

from rhythmid.errors import InputError
from rhythmid.export import csv, isaac, matlab, mujoco, nav2, sdf, urdf
from rhythmid.export.joint import Joint

Target = Literal["mujoco", "urdf", "sdf", "isaac", "matlab", "csv", "nav2"]
WRITERS: Mapping[Target, Callable[[Sequence[Joint], str], str]] = MappingProxyType(
    {
        "mujoco": mujoco.text,
        "urdf": urdf.text,
        "sdf": sdf.text,
        "isaac": isaac.text,
        "matlab": matlab.text,
        "csv": csv.text,
        "nav2": nav2.text,
    }
)


def exported(joints: Sequence[Joint], target: str, source: str = "a model") -> str:
    """Text of the target's file for at least one joint; `source` names the model in its first comment.

    Raises InputError for an unknown target, two joints with one name, and joints that the target cannot combine.
    """
    known = next((one for one in get_args(Target) if one == target), None)
    if known is None:
        raise InputError(f"--to {target}: is none of {', '.join(get_args(Target))}")
    names = [joint.name for joint in joints]
    if not names or len(set(names)) < len(names):
        raise InputError(f"an export takes joints of different names, at least one; there are {names}")
    return WRITERS[known](joints, " ".join("".join(c if c.isprintable() else " " for c in source).split()))
