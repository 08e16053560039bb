"""Definitions of message types for a bag: ROS 2's own are known, others are read from their installed packages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.interfaces import Nodetype
from rosbags.typesys import TypesysError, get_types_from_msg

from rhythmid.errors import InputError


def learn(typestore: Any, type_name: str) -> None:
    """Add `type_name`, such as `sensor_msgs/msg/JointState`, and the types that it is made of to a rosbags typestore.

    Raises InputError when a definition is not installed or cannot be parsed.
    """
    if type_name in typestore.fielddefs:
        return
    package, _, name = type_name.split("/")
    try:
        text = (Path(get_package_share_directory(package)) / "msg" / f"{name}.msg").read_text(
            encoding="utf-8"
        )
        found = get_types_from_msg(text, type_name)
    except (PackageNotFoundError, OSError, TypesysError):
        raise InputError(f"the definition of {type_name} is not installed; leave its topic out") from None
    for _, kind in found[type_name][1]:
        while kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            kind = kind[1][0]
        if kind[0] == Nodetype.NAME:
            learn(typestore, str(kind[1]))
    typestore.register(found)
