"""Recordings of a batch are in their natural order, and a task prints as its name."""

from pathlib import Path

import pytest

from rhythmid.batch.manifest import IdentifyOptions
from rhythmid.batch.task import Task, _matches
from rhythmid.document import Node


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["run11", "run6", "run10"], ["run6", "run10", "run11"]),
        (["b1_t10", "b1_t9", "a"], ["a", "b1_t9", "b1_t10"]),
        (["1.csv", "x.csv", "02.csv"], ["1.csv", "02.csv", "x.csv"]),
    ],
)
def test_numbers_in_names_count_as_numbers(tmp_path, names, expected):
    for name in names:
        (tmp_path / name).touch()
    found = _matches(["*"], tmp_path, Node(None, "bags", "manifest"))
    assert [path.name for path in found] == expected


def test_a_task_prints_as_its_name():
    task = Task(
        "rigA/run1", "run1", "rig A", "identify", (Path("run1"),), (), None, False, None, None, (), ("m", "s"),
        IdentifyOptions(),
    )  # fmt: skip
    assert repr(task) == "Task('rigA/run1', 'identify')"
