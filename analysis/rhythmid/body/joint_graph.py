"""ROS graph of an experiment with a machine of several joints: excitation, plant and recorder.

Delays of commands and measurements are in the joints' paths, so there are no delay injectors.
"""

import json
from pathlib import Path

from rhythmid.body.joint_experiment import JointExperiment
from rhythmid.document import read
from rhythmid.errors import InputError
from rhythmid.experiment import NodeSpec


def joint_nodes(experiment: JointExperiment) -> list[NodeSpec]:
    """The nodes with their parameters. Raises InputError where the experiment names no model."""
    if experiment.model is None:
        raise InputError(f"{experiment.path}: 'model:' is missing")
    time = experiment.time
    run = {
        "time_mode": time.mode,
        "rate": time.rate,
        "window": time.window,
        "count": experiment.count,
        "experiment": str(experiment.path),
    }
    recorded = [topic for topic in experiment.record.topics if topic != "run"]
    sinks = ["recorder"] if recorded else []
    safety = experiment.safety
    return [
        NodeSpec(
            "rhythmid_nodes", "joint_plant", "plant",
            {**run, "consumers": sinks, "command_timeout": safety.command_timeout},
        ),
        NodeSpec(
            "rhythmid_nodes", "joint_excitation", "excitation",
            {
                **run,
                "ramp": safety.ramp,
                "run": json.dumps(description(experiment)),
                "subscribers": 1 + ("command" in recorded),
                "consumers": ["plant", *sinks],
            },
        ),
        NodeSpec(
            "rhythmid_nodes", "recorder", "recorder",
            {
                **{name: value for name, value in run.items() if name != "experiment"},
                "path": str(experiment.record.path),
                "storage": experiment.record.storage,
                "topics": list(experiment.record.topics),
            },
            {"diagnostics": "/diagnostics"},
        ),
    ]  # fmt: skip


def description(experiment: JointExperiment) -> dict:
    """Content of the topic `run`: the experiment as run, without the machine, which is to be identified."""
    return {
        "program": "rhythmid",
        "excitation": read(experiment.path).at("excitation").plain,
        "rate": experiment.rate,
        "time": experiment.time.mode,
        "duration": experiment.count * experiment.period_ns * 1e-9,
        "namespace": experiment.namespace,
        "hold": "zero",
    }


def describes_joints(path: str | Path) -> bool:
    """Whether an experiment file is for several joints: its `excitation` has a mapping for each joint."""
    known = read(path).at("excitation").value
    return isinstance(known, dict) and "type" not in known
