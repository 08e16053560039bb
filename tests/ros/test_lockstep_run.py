"""`rhythmid run` in lockstep: the same data by every way, with and without ROS."""

import json

import numpy as np
import pytest
from patience import LONG
from short_run import BRIEF, content, experiment_file

from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform

pytestmark = pytest.mark.timeout(LONG)


@pytest.fixture(scope="module")
def offline(tmp_path_factory):
    return perform(Experiment.load(experiment_file(tmp_path_factory.mktemp("offline"), excitation=BRIEF)))


def assert_equal_to(offline, bag):
    """A bag holds what the run without ROS gives, and nothing of what is concealed."""
    rows, run = content(bag)
    assert set(rows) == set(offline)
    for topic, messages in offline.items():
        heard = np.array(rows[topic], dtype=object)
        assert heard[:, 0].tolist() == messages.stamp_ns.tolist(), topic
        for column, field in enumerate(("position", "velocity", "effort"), start=1):
            if getattr(messages, field) is not None:
                np.testing.assert_array_equal(heard[:, column].astype(float), getattr(messages, field), topic)
    assert [said["state"] for said in run] == ["running", "finished"]
    concealed = json.dumps(run)
    assert "0.0403" not in concealed and "0.0507" not in concealed and "stiffness" not in concealed


def test_lockstep_in_processes_equals_the_run_without_ros(rhythmid, tmp_path, offline):
    time = {"layout": "processes", "window": 7}
    done = rhythmid(
        "run", experiment_file(tmp_path, time=time, record={"storage": "sqlite3"}, excitation=BRIEF)
    )
    assert done.returncode == 0, done.stderr
    (none,) = {line.split()[0] for line in done.stderr.splitlines() if "clamped_commands" in line}
    assert (
        none == "none" and "lifecycle" not in done.stderr
    )  # only what is not as it should be has a line of its own
    assert_equal_to(offline, tmp_path / "experiment_bag")


def test_equal_lockstep_runs_give_equal_bytes_and_equal_the_run_without_ros(rhythmid, tmp_path, offline):
    """Whatever the layout and the window: what the middleware interleaves otherwise stands in the bag in one order."""
    found = []
    for layout, window in (("composed", 100), ("processes", 13)):
        path = experiment_file(
            tmp_path, time={"layout": layout, "window": window}, excitation=BRIEF
        )  # fmt: skip
        page = tmp_path / f"{layout}.html"
        done = rhythmid("run", path, "--out", tmp_path / layout / "bag", "--report", page)
        assert done.returncode == 0, done.stderr
        told = page.read_text(encoding="utf-8")
        assert "<h1>The run finished</h1>" in told and "/hopper/joint_states" in told
        found.append({file.name: file.read_bytes() for file in (tmp_path / layout / "bag").iterdir()})
    assert set(found[0]) == set(found[1])
    for name, data in found[0].items():
        assert data == found[1][name], name
    assert_equal_to(offline, tmp_path / "composed" / "bag")


def test_lockstep_follows_a_delay_profile_as_the_run_without_ros_does(rhythmid, tmp_path):
    (tmp_path / "profile.csv").write_text("0,0.04\n0.7,0.06\n0.71,0.0\n1.5,0.2\n")
    path = experiment_file(
        tmp_path, delays={"input": {"profile": "profile.csv"}}, time={"window": 1}, excitation=BRIEF
    )  # fmt: skip
    done = rhythmid("run", path, "--out", tmp_path / "out" / "bag")
    assert done.returncode == 0, done.stderr
    rows, _ = content(tmp_path / "out" / "bag")
    expected = perform(Experiment.load(path))
    for topic in ("command", "joint_states"):
        assert [row.stamp_ns for row in rows[topic]] == expected[topic].stamp_ns.tolist()
    assert [row.position for row in rows["joint_states"]] == expected["joint_states"].position.tolist()
