"""Recorder over real topics: any type and quality of service, nothing lost unsaid, readable after a crash."""

import errno
import os
import signal
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import qos_profile_sensor_data
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from std_msgs.msg import String

from rhythmid.errors import InputError
from rhythmid.record.bag_writer import BagWriter
from rhythmid.record.recover import recover
from rhythmid_nodes.bag import LiveBag
from rhythmid_nodes.qos import latched
from rhythmid_nodes.recorder import Recorder

MS = 1_000_000
TYPES = get_typestore(Stores.ROS2_JAZZY)


def finish(graph, recorder):
    """End a recorder of this process; what it says at the end."""
    graph.nodes.remove(recorder)
    graph.executor.remove_node(recorder)
    recorder.close()
    figures = recorder.figures()
    recorder.destroy_node()
    return figures


def read(bag):
    """Topic -> messages of a bag."""
    content = {}
    with Reader(bag) as reader:
        for connection, _, data in reader.messages():
            content.setdefault(connection.topic, []).append(TYPES.deserialize_cdr(data, connection.msgtype))
    return content


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_messages_of_any_type_and_quality_of_service_are_recorded(graph, tmp_path, storage):
    bag = tmp_path / "bag"
    topics = ["joint_states", "force", "run"]
    recorder = graph.add(Recorder, path=str(bag), storage=storage, topics=topics)
    latch = graph.probe.create_publisher(String, "run", latched())
    latch.publish(String(data="said before anybody listened"))
    send = graph.talk("joint_states", qos=qos_profile_sensor_data)
    push = graph.talk("force", WrenchStamped)
    graph.until(lambda: not recorder.obstacles(), "readiness")
    for k in range(100):
        send(graph.joint_state(k * MS, position=k * 1e-3))
        push(WrenchStamped())
        graph.spin(0.001)
    graph.until(lambda: sum(track.received for track in recorder._tracks.values()) == 201, "201 messages")
    figures = finish(graph, recorder)
    assert figures["lost"] == figures["dropped"] == "0"
    assert (
        "100 messages, 1000.000 Hz, 0 duplicates, 0 backwards, 0 missing" in figures["/hopper/joint_states"]
    )
    content = read(bag)
    assert [m.position[0] for m in content["/hopper/joint_states"]] == [k * 1e-3 for k in range(100)]
    assert len(content["/hopper/force"]) == 100
    assert content["/hopper/run"][0].data == "said before anybody listened"


def test_gaps_duplicates_and_steps_back_are_told(graph, tmp_path):
    recorder = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"])
    send = graph.talk("joint_states")
    graph.until(lambda: not recorder.obstacles(), "readiness")
    for k in (0, 1, 2, 2, 5, 4, 9):
        send(graph.joint_state(k * MS, position=0.0))
    graph.until(lambda: recorder._tracks["/hopper/joint_states"].received == 7, "7 messages")
    said = finish(graph, recorder)["/hopper/joint_states"]
    assert "1 duplicates, 1 backwards, 4 missing, longest interval 5.000 ms" in said


def test_pause_and_resume(graph, tmp_path):
    bag = tmp_path / "bag"
    recorder = graph.add(Recorder, path=str(bag), topics=["joint_states"])
    send = graph.talk("joint_states")
    graph.until(lambda: not recorder.obstacles(), "readiness")

    def say(position):
        before = recorder._tracks["/hopper/joint_states"].received
        send(graph.joint_state(time.time_ns(), position=position))
        graph.until(lambda: recorder._tracks["/hopper/joint_states"].received > before, "the message")

    say(1.0)
    assert graph.call("recorder/pause").success and not graph.call("recorder/pause").success
    say(2.0)
    assert graph.call("recorder/resume").success and not graph.call("recorder/resume").success
    say(3.0)
    assert finish(graph, recorder)["not_recorded_while_paused"] == "1"
    assert [m.position[0] for m in read(bag)["/hopper/joint_states"]] == [1.0, 3.0]


def test_what_does_not_fit_the_queue_is_dropped_and_counted(graph, tmp_path):
    recorder = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"], queue_size=1)
    send = graph.talk("joint_states")
    graph.until(lambda: not recorder.obstacles(), "readiness")
    for k in range(500):
        send(graph.joint_state(k * MS, position=0.0))
    graph.until(lambda: recorder._tracks["/hopper/joint_states"].received == 500, "500 messages")
    dropped = int(finish(graph, recorder)["dropped"])
    assert dropped > 0 and len(read(tmp_path / "bag")["/hopper/joint_states"]) == 500 - dropped


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_after_kill_9_all_but_the_last_moment_is_readable(no_shared_memory, graph, tmp_path, storage):
    bag = tmp_path / "bag"
    process = graph.spawn(
        "recorder", "recorder", path=str(bag), topics=["joint_states"], storage=storage, flush_period=0.2
    )
    send = graph.talk("joint_states")
    ready = graph.listen("/diagnostics", DiagnosticArray, latched())
    graph.until(lambda: any(m.status[0].message == "ok" for m in ready), "readiness")
    graph.until(lambda: graph.probe.count_subscribers("/hopper/joint_states") == 1, "the subscription")
    for k in range(300):
        send(graph.joint_state(k * MS, position=float(k)))
        graph.spin(0.001)
    graph.spin(1.0)  # five flush periods
    process.signal(signal.SIGKILL)
    graph.until(lambda: process.returncode is not None, "the end")
    assert not (bag / "metadata.yaml").exists()
    recover(bag, tmp_path / "recovered")
    assert [m.position[0] for m in read(tmp_path / "recovered")["/hopper/joint_states"]] == list(range(300))


def test_a_robots_own_message_types_are_recorded_with_their_definitions(tmp_path, monkeypatch):
    share = tmp_path / "share"
    (share / "ament_index/resource_index/packages").mkdir(parents=True)
    (share / "ament_index/resource_index/packages/my_robot").touch()
    (share / "my_robot/msg").mkdir(parents=True)
    (share / "my_robot/msg/Leg.msg").write_text("std_msgs/Header header\nToe[] toes\nfloat64 knee\n")
    (share / "my_robot/msg/Toe.msg").write_text("geometry_msgs/Vector3 force\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    bag = LiveBag(tmp_path / "bag", "mcap", 1.0, 10)
    bag.open()
    bag.add_topic("/leg", "my_robot/msg/Leg", [])
    with pytest.raises(InputError, match="my_robot/msg/Arm is not installed"):
        bag.add_topic("/arm", "my_robot/msg/Arm", [])
    bag.stop()
    with Reader(tmp_path / "bag") as reader:
        (connection,) = reader.connections
    assert connection.msgtype == "my_robot/msg/Leg" and "MSG: my_robot/Toe" in connection.msgdef.data


def test_a_disk_that_fills_up_is_told_in_one_line(graph, tmp_path, monkeypatch):
    def full(self):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(BagWriter, "flush", full)
    recorder = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"], flush_period=0.1)
    graph.until(lambda: recorder.failure is not None, "the failure")
    assert isinstance(recorder.failure, InputError) and "No space left on device" in str(recorder.failure)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({}, "path is missing"),
        ({"path": "{taken}"}, "exists already"),
        ({"path": "{file}/bag"}, "Not a directory"),
        ({"path": "{new}", "storage": "csv"}, "one of mcap, sqlite3"),
        ({"path": "{new}", "flush_period": 0.0}, r"\[0.1, 60\] s"),
    ],
)
def test_what_cannot_work_is_refused(graph, tmp_path, parameters, said):
    (tmp_path / "taken").mkdir()
    (tmp_path / "file").touch()
    places = {name: tmp_path / name for name in ("taken", "file", "new")}
    given = {k: v.format(**places) if isinstance(v, str) else v for k, v in parameters.items()}
    with pytest.raises(InputError, match=said):
        graph.add(Recorder, **given)
    assert not (tmp_path / "new").exists()
