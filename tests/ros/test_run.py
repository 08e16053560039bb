"""`rhythmid run`: nothing is lost, and a valid bag is left however a run ends."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import rclpy
from patience import LONG, PATIENCE
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState
from short_run import BRIEF, MODEL, content, experiment_file

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform
from rhythmid.record.bag import Bag
from rhythmid_bringup.start_up import STOPPED

pytestmark = pytest.mark.timeout(LONG)


def recorded(bag: Path) -> Counter[str]:
    """Topic -> number of messages that are on the disk of a bag that may still be written."""
    counts = Counter()
    try:
        for block in Bag(bag).blocks():
            counts[block.topic.name] += len(block)
    except InputError:  # not yet a bag
        pass
    return counts


class Running:
    """`rhythmid run` in the background."""

    def __init__(self, path: Path, *options):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rhythmid.cli", "run", str(path), *options],
            stderr=subprocess.PIPE, text=True, cwd=path.parent,
        )  # fmt: skip

    def children(self) -> dict[str, int]:
        """Module -> process id of the nodes."""
        found = {}
        for entry in Path("/proc").iterdir():
            try:
                words = (entry / "cmdline").read_text().split("\0")
                parent = re.search(r"PPid:\s*(\d+)", (entry / "status").read_text())
            except OSError:
                continue
            if parent and int(parent[1]) == self.process.pid and "-m" in words:
                found[words[words.index("-m") + 1].removeprefix("rhythmid_nodes.")] = int(entry.name)
        return found

    def wait_for_samples(self, bag: Path):
        """Until samples of the excitation, which starts last, are on the disk, or the run has failed to come so far."""
        patience = time.monotonic() + 2 * PATIENCE
        while recorded(bag).get("/hopper/excitation", 0) < 100:
            assert self.process.poll() is None and time.monotonic() < patience, self.process.stderr.read()
            time.sleep(0.05)

    def end(self, timeout=PATIENCE) -> tuple[int, str]:
        _, said = self.process.communicate(timeout=timeout)
        return self.process.returncode, said


@pytest.fixture
def started():
    """Starts runs that do not outlive their test."""
    running = []

    def start(path, *options):
        running.append(Running(path, *options))
        return running[-1]

    yield start
    for run in running:
        if run.process.poll() is None:
            run.process.kill()
            run.process.wait()


def places(heard: list, given: list) -> list[int]:
    """Where in what was given each value stands that was heard, in this order; what was given may have been left out."""
    found, place = [], -1
    for value in heard:
        place = given.index(value, place + 1)
        found.append(place)
    return found


def test_real_time_loses_nothing_and_reports_its_lateness(rhythmid, tmp_path):
    """After a stall of more than 0.1 s the newest sample follows, which a busy machine may bring about: what counts is what was sent."""
    path = experiment_file(tmp_path, time={"mode": "realtime", "layout": "processes"}, excitation=BRIEF)
    done = rhythmid("run", path)
    assert done.returncode == 0, done.stderr
    rows, run = content(tmp_path / "experiment_bag")
    timing = run[-1]["timing"]
    assert run[-1]["state"] == "finished" and run[-1]["samples"] == 1500 and timing["lost"] == 0
    grid = {topic: np.array([row.stamp_ns for row in rows[topic]]) for topic in rows}
    for topic in ("excitation", "forcing", "plant/joint_states"):
        steps = np.diff(grid[topic])
        assert np.all((steps > 0) & (steps % 1_000_000 == 0)), topic
    assert (grid["excitation"][0] - run[0]["start_ns"]) % 1_000_000 == 0
    assert len(grid["excitation"]) == timing["excitation"]["of"] + 1  # and a last one of zero
    assert len(grid["command"]) >= timing["command_delay"]["of"] > 100
    for topic, source, delay in (
        ("command", "excitation", 40_300_000),
        ("joint_states", "plant/joint_states", 50_700_000),
    ):
        key = "effort" if topic == "command" else "position"
        given, heard = ([getattr(row, key) for row in rows[name]] for name in (source, topic))
        early = next(number for number, value in enumerate(heard) if value in given)  # before the recorder
        assert len(heard) - early > 100
        sent = grid[source][places(heard[early:], given)]  # fails where the order is another
        assert np.all(grid[topic][early:] - sent >= delay), topic
    for said in ("lateness_p99_ms", "delay_error_max_ms", "applied_delay_mean_ms", "late_commands"):
        assert said in done.stderr
    for stage in ("excitation", "command_delay", "plant", "measurement_delay"):
        assert 0 <= timing[stage]["late"] <= timing[stage]["of"], stage
        assert 0.0 <= timing[stage]["mean"] <= timing[stage]["max"], stage
    concealed = json.dumps(run)
    assert "40.3" not in concealed and "0.0403" not in concealed and "stiffness" not in concealed


def test_an_existing_bag_is_refused_before_anything_starts(refused, tmp_path):
    path = experiment_file(tmp_path)
    (tmp_path / "experiment_bag").mkdir()
    assert "experiment_bag: exists already" in refused("run", path)


def test_a_place_that_cannot_be_written_is_refused_with_code_2(refused, tmp_path):
    (tmp_path / "file").touch()
    assert "file/bag" in refused("run", experiment_file(tmp_path), "--out", tmp_path / "file" / "bag")


def test_what_a_node_refuses_is_told_in_one_line_with_code_2(rhythmid, tmp_path):
    """That this machine is too light for the simulator's step shows only when the plant starts."""
    text = MODEL.read_text().replace("mass: {value: 1.0,", "mass: {value: 1.0e-9,")
    (tmp_path / "light.yaml").write_text(text)
    done = rhythmid("run", experiment_file(tmp_path, model="light.yaml"))
    # on a busy machine the run says every 20 s what it waits for
    lines = [line for line in done.stderr.strip().splitlines() if not line.startswith("waiting for ")]
    assert done.returncode == 2 and len(lines) == 1, done.stderr
    assert "error: graph: " in lines[0] and "diverges" in lines[0]


def test_stopped_before_it_begins_it_leaves_no_bag_and_says_so_in_one_line(started, tmp_path):
    path = experiment_file(tmp_path, time={"mode": "realtime", "layout": "processes"})
    run = started(
        path, "--replace", f"plant={sys.executable} -c 'import time; time.sleep(600)'"
    )  # it never begins
    patience = time.monotonic() + PATIENCE
    while "recorder" not in run.children():
        assert run.process.poll() is None and time.monotonic() < patience
        time.sleep(0.05)
    children = run.children()
    run.process.send_signal(signal.SIGINT)
    code, said = run.end()
    (line,) = said.splitlines()
    assert code == 0 and line.startswith(f"{STOPPED}; it waited for ") and "in the place of plant" in line
    assert not (tmp_path / "experiment_bag").exists()
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


@pytest.mark.parametrize(("layout", "number"), [("processes", signal.SIGINT), ("composed", signal.SIGTERM)])
def test_stopped_by_the_user_it_leaves_a_valid_bag(started, tmp_path, layout, number):
    path = experiment_file(
        tmp_path, time={"mode": "realtime", "layout": layout}, duration=60.0, safety={"ramp": 0.1, "max_effort": 1.0}
    )  # fmt: skip
    run = started(path)
    run.wait_for_samples(tmp_path / "experiment_bag")
    children = run.children()
    run.process.send_signal(number)
    code, said = run.end()
    assert code == 0 and "stopped by the user" in said
    assert (
        "No transition matching" not in said
    )  # each transition is requested once, however late its outcome is told
    rows, states = content(tmp_path / "experiment_bag")
    assert states[-1]["state"] == "stopped" and rows["excitation"][-1].effort == 0.0
    steps = np.diff([row.stamp_ns for row in rows["forcing"]])
    assert np.all((steps > 0) & (steps % 1_000_000 == 0))  # after a stall the newest sample follows
    assert children and not any(Path(f"/proc/{pid}").exists() for pid in children.values())


@pytest.mark.parametrize("victim", ["plant", "recorder"])
def test_a_nodes_death_ends_the_run_with_a_valid_bag(no_shared_memory, started, tmp_path, victim):
    path = experiment_file(tmp_path, time={"mode": "realtime", "layout": "processes"}, duration=60.0)
    run = started(path)
    run.wait_for_samples(tmp_path / "experiment_bag")
    children = run.children()
    os.kill(children[victim], signal.SIGKILL)
    code, said = run.end()
    assert code == 1 and f"{victim} was killed by SIGKILL" in said
    rows, _ = content(tmp_path / "experiment_bag")
    assert rows["excitation"] and len(rows["joint_states"]) > 50
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


def test_a_full_disk_ends_the_run_with_its_reason_and_what_was_written(no_shared_memory, started, tmp_path):
    path = experiment_file(tmp_path, time={"mode": "realtime", "layout": "processes"}, duration=60.0)
    run = started(path)
    run.wait_for_samples(tmp_path / "experiment_bag")
    written = sum(file.stat().st_size for file in (tmp_path / "experiment_bag").iterdir())
    limit = written + 100_000  # the system refuses to write more
    resource.prlimit(run.children()["recorder"], resource.RLIMIT_FSIZE, (limit, limit))
    code, said = run.end()
    assert code == 1 and "recorder: " in said and "File too large" in said, said
    assert "Traceback" not in said
    rows, _ = content(tmp_path / "experiment_bag")
    assert rows["excitation"] and len(rows["joint_states"]) > 50


def test_a_stranger_who_commands_ends_the_run_with_code_1_and_is_named(
    domain, monkeypatch, started, tmp_path
):
    monkeypatch.delenv("RHYTHMID_SUPERVISOR")  # of nodes that this process starts
    path = experiment_file(tmp_path, time={"mode": "realtime", "layout": "processes"}, duration=60.0)
    run = started(path)
    run.wait_for_samples(tmp_path / "experiment_bag")
    rclpy.init(args=[])
    try:
        stranger = Node("stranger", namespace="/elsewhere")
        publisher = stranger.create_publisher(JointState, "/hopper/command", 10)
        patience = time.monotonic() + PATIENCE
        while publisher.get_subscription_count() == 0 and time.monotonic() < patience:
            time.sleep(0.01)
        for _ in range(20):
            publisher.publish(JointState(name=["leg"], effort=[5.0]))
        code, said = run.end()
        stranger.destroy_node()
    finally:
        try_shutdown()
    assert code == 1
    assert "2 publishers of /hopper/command: /elsewhere/stranger, /hopper/command_delay" in said, said
    rows, states = content(tmp_path / "experiment_bag")
    assert max(abs(row.effort) for row in rows["command"] if row.stamp_ns > 0) <= 0.05
    assert (
        max(abs(state.effort) for state in rows["plant/joint_states"]) < 1.1
    )  # forcing and excitation, not 5 N
    assert "/elsewhere/stranger" in states[-1]["failure"]
    assert "/elsewhere/stranger" in states[-1]["foreign"]["plant"]["conflict"]


def test_a_node_that_lives_and_does_not_work_ends_the_run(no_shared_memory, started, tmp_path):
    # a reader that takes nothing makes its writers slow: they may fall silent, too
    path = experiment_file(
        tmp_path,
        time={"mode": "realtime", "layout": "processes"},
        duration=60.0,
    )
    run = started(path)
    run.wait_for_samples(tmp_path / "experiment_bag")
    children = run.children()
    os.kill(children["recorder"], signal.SIGSTOP)
    code, said = run.end()
    assert code == 1 and re.search(r"nothing was heard from [\w, ]*\brecorder\b.* for 5 s", said), said
    rows, _ = content(tmp_path / "experiment_bag")
    assert rows["excitation"]
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


def test_the_nodes_end_when_the_supervisor_is_killed(no_shared_memory, started, tmp_path):
    run = started(experiment_file(tmp_path, time={"mode": "realtime", "layout": "composed"}, duration=60.0))
    run.wait_for_samples(tmp_path / "experiment_bag")
    children = run.children()
    run.process.kill()
    patience = time.monotonic() + PATIENCE
    while any(Path(f"/proc/{pid}").exists() for pid in children.values()):
        assert time.monotonic() < patience
        time.sleep(0.05)
    rows, _ = content(tmp_path / "experiment_bag")
    assert rows["joint_states"]


def test_a_machine_that_leaves_its_envelope_ends_the_run_with_code_1(rhythmid, tmp_path):
    path = experiment_file(
        tmp_path,
        time={"mode": "realtime"},
        excitation={"type": "profile", "points": [[0.0, 0.0], [0.5, 20.0]], "length": 20.0},
        safety={"envelope": [0.0, 0.25], "max_effort": 30.0},
    )
    done = rhythmid("run", path, "--report", tmp_path / "page.html")
    assert done.returncode == 1 and "outside the envelope" in done.stderr
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<h1>The run broke off</h1>" in page and "outside the envelope" in page
    rows, run = content(tmp_path / "experiment_bag")
    assert run[-1]["state"] == "stopped" and rows["excitation"][-1].effort == 0.0


def test_nodes_started_one_by_one_find_each_other_and_end_by_themselves(domain, started, rhythmid, tmp_path):
    """As in containers: whichever comes first, the lockstep run is complete."""
    path = experiment_file(tmp_path, excitation={"sweep": 1.0})
    nodes = {name: started(path, "--node", name) for name in ("excitation", "plant", "command_delay")}
    nodes["recorder"] = started(path, "--node", "recorder")
    time.sleep(0.5)
    nodes["measurement_delay"] = started(path, "--node", "measurement_delay")  # late on purpose
    code, said = nodes.pop("excitation").end()
    assert code == 0, said
    for node in nodes.values():
        node.process.send_signal(signal.SIGTERM)  # what `docker compose` does when one container has ended
        code, said = node.end()
        assert code == 0, said
    rows, _ = content(tmp_path / "experiment_bag")
    expected = perform(Experiment.load(path))
    assert [row.position for row in rows["joint_states"]] == expected["joint_states"].position.tolist()


def test_an_unknown_node_is_refused_with_the_names_there_are(refused, tmp_path):
    said = refused("run", experiment_file(tmp_path), "--node", "wheel")
    assert "plant, command_delay, measurement_delay, excitation, recorder" in said
