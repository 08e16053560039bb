"""Several nodes in one process on one EventsExecutor: the fastest layout in lockstep.

    python -m rhythmid_nodes.compose GRAPH.json

GRAPH.json: a list of {"executable": "plant", "arguments": ["--ros-args", …]}, the arguments being those that the node
would get in a process of its own.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from .command_guard import CommandGuard
from .delay_injector import DelayInjector
from .excitation import ExcitationNode
from .joint_excitation import JointExcitationNode
from .joint_plant import JointPlantNode
from .node import GraphNode, serve
from .plant import PlantNode
from .recorder import Recorder

EXECUTABLES: dict[str, Callable[..., GraphNode]] = {
    "plant": PlantNode,
    "excitation": ExcitationNode,
    "joint_plant": JointPlantNode,
    "joint_excitation": JointExcitationNode,
    "delay_injector": DelayInjector,
    "recorder": Recorder,
    "command_guard": CommandGuard,
}


def main() -> None:
    graph = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    build = [
        partial(EXECUTABLES[node["executable"]], cli_args=node["arguments"], use_global_arguments=False)
        for node in graph
    ]
    sys.exit(serve(build, []))


if __name__ == "__main__":
    main()
