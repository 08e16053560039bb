"""A node of an experiment as a command line: name, namespace, remappings and a parameter file."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from rhythmid.experiment import NodeSpec


def given_parameters(spec: NodeSpec) -> dict[str, Any]:
    """The node's parameters without empty lists, which ROS cannot hold: not given means none."""
    return {name: value for name, value in spec.parameters.items() if value != []}


def ros_arguments(
    spec: NodeSpec, namespace: str, folder: Path, extra: Mapping[str, Any] | None = None
) -> list[str]:
    """Arguments from `--ros-args` on; writes the parameter file into `folder`."""
    path = folder / f"{spec.name}.yaml"
    parameters = {**given_parameters(spec), **(extra or {})}
    text = yaml.safe_dump({"/**": {"ros__parameters": parameters}}, width=2**16)
    path.write_text(text, encoding="utf-8")
    names = {"__node": spec.name, "__ns": namespace, **spec.remappings}
    return ["--ros-args", "--params-file", str(path), *remapping_arguments(names)]


def remapping_arguments(names: Mapping[str, str]) -> list[str]:
    """Remapping arguments."""
    return [word for source, target in names.items() for word in ("-r", f"{source}:={target}")]


def command(spec: NodeSpec, arguments: list[str]) -> list[str]:
    """The command that runs the node in a separate process."""
    return [sys.executable, "-P", "-m", f"{spec.package}.{spec.executable}", *arguments]


def replacement_command(spec: NodeSpec, namespace: str, given: Sequence[str]) -> list[str]:
    """The command of a user's node in the place of `spec`: in the same namespace, with the same topics, and with the user's parameters."""
    return [*given, "--ros-args", *remapping_arguments({"__ns": namespace, **spec.remappings})]


def compose_command(graph: Path) -> list[str]:
    """The command that runs all nodes of `graph` (see rhythmid_nodes.compose) in one process."""
    return [sys.executable, "-P", "-m", "rhythmid_nodes.compose", str(graph)]
