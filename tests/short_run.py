"""A short run of the ROS graph, and what its bag holds."""

import json
from pathlib import Path

import yaml
from patience import UNHURRIED
from rosbags.rosbag2 import Reader

from rhythmid_nodes.joint_state import JointStateReader

MODEL = Path(__file__).parents[1] / "analysis" / "rhythmid" / "models" / "paper_hopper.yaml"
ALL = ["excitation", "command", "forcing", "plant/joint_states", "joint_states", "run"]
BRIEF = {"sweep": 1.5}  # s: enough messages for windows of any length to be crossed many times


def experiment_file(folder: Path, name="experiment", **changes) -> Path:
    """A short chirp through two delays that are no whole number of samples."""
    content = {
        "model": str(MODEL),
        "excitation": {"type": "chirp", "amplitude": 0.05, "band": [1, 7], "sweep": 3.0},
        "delays": {"input": 0.0403, "measurement": 0.0507},
        "noise": {"measurement_std": 1e-4},
        "seed": 3,
        "time": {"mode": "lockstep"},
        "safety": {"stale_after": UNHURRIED},
        "record": {"path": str(folder / f"{name}_bag"), "topics": ALL},
    }
    for key, value in changes.items():
        merge = isinstance(content.get(key), dict) and "type" not in value
        content[key] = {**content[key], **value} if merge else value
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def content(bag: Path, namespace="/hopper"):
    """Topic -> rows of (stamp_ns, position, velocity, effort), and what `run` said."""
    joint, rows, run = JointStateReader("leg"), {}, []
    with Reader(bag) as reader:
        for connection, _, data in reader.messages():
            topic = connection.topic.removeprefix(f"{namespace}/")
            if topic == "run":
                run.append(json.loads(data[8 : 8 + int.from_bytes(data[4:8], "little") - 1]))
            else:
                rows.setdefault(topic, []).append(joint.read(data))
    return rows, run
