"""Recorder over real topics: any type and quality of service, nothing lost unsaid, readable after a crash."""

import resource
import time

import pytest
import yaml
from geometry_msgs.msg import WrenchStamped
from kill_recorder import kill
from patience import LONG
from rclpy.qos import qos_profile_sensor_data
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.recover import recover
from rhythmid_nodes.bag import LiveBag, Storage
from rhythmid_nodes.qos import latched
from rhythmid_nodes.recorder import Recorder

MS = 1_000_000
DURATION = 2.0  # s of a file, longer than fifty messages take on a busy machine
ATTEMPTS = 3  # to lose no more than is promised: a machine that stalls has the recorder write later
pytestmark = pytest.mark.timeout(LONG)
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
    began_ns = time.time_ns()
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
    if storage == "mcap":
        blocks = [block for block in Bag(bag).blocks() if block.topic.name != "/hopper/run"]
        assert all((began_ns <= block.sent_ns).all() for block in blocks)
        assert all((block.sent_ns < block.log_ns).all() for block in blocks)


def test_gaps_duplicates_and_steps_back_are_told(graph, tmp_path):
    recorder = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"])
    send = graph.talk("joint_states")
    graph.until(lambda: not recorder.obstacles(), "readiness")
    for k in (0, 1, 2, 2, 5, 4, 9):
        send(graph.joint_state(k * MS, position=0.0))
    graph.until(lambda: recorder._tracks["/hopper/joint_states"].received == 7, "7 messages")
    said = finish(graph, recorder)["/hopper/joint_states"]
    assert "1 duplicates, 1 backwards, 4 missing, longest interval 5.000 ms" in said


@pytest.fixture
def recording(graph, tmp_path):
    """A recorder of `joint_states` with some parameters, and a function that sends positions and waits until they are in."""

    def start(**parameters):
        recorder = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"], **parameters)
        send = graph.talk("joint_states")
        graph.until(lambda: not recorder.obstacles(), "readiness")
        track = recorder._tracks["/hopper/joint_states"]

        def say(*positions):
            before = track.received
            for position in positions:
                send(graph.joint_state(time.time_ns(), position=position))
            graph.until(lambda: track.received == before + len(positions), "the messages")
            graph.until(lambda: not len(recorder._bag), "an empty queue")

        return recorder, say

    return start


def test_pause_resume_and_toggle(graph, recording, tmp_path):
    recorder, say = recording(start_paused=True)
    say(0.0)
    assert graph.call("recorder/is_paused").success
    assert graph.call("recorder/resume").success and not graph.call("recorder/resume").success
    say(1.0)
    assert graph.call("recorder/pause").success and not graph.call("recorder/pause").success
    say(2.0)
    assert graph.call("recorder/toggle_paused").message == "recording"
    assert not graph.call("recorder/is_paused").success
    say(3.0)
    assert finish(graph, recorder)["not_recorded_while_paused"] == "2"
    assert [m.position[0] for m in read(tmp_path / "bag")["/hopper/joint_states"]] == [1.0, 3.0]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_is_split_by_size_by_time_and_when_asked(graph, recording, tmp_path, storage):
    recorder, say = recording(storage=storage, max_bagfile_size=1000, max_bagfile_duration=DURATION)
    say(*range(50))  # 52 bytes each
    graph.spin(DURATION + 0.1)
    say(50.0)
    files = len(list((tmp_path / "bag").glob("bag_*")))
    assert graph.call("recorder/split_bagfile").success
    graph.until(lambda: len(list((tmp_path / "bag").glob("bag_*[0-9].*"))) > files, "the next file")
    say(51.0)
    finish(graph, recorder)
    listed = yaml.safe_load((tmp_path / "bag/metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert listed["relative_file_paths"] == [file["path"] for file in listed["files"]]
    parts = [file["message_count"] for file in listed["files"]]
    assert parts == [20, 20, 10, 1, 1]
    assert [m.position[0] for m in read(tmp_path / "bag")["/hopper/joint_states"]] == list(range(52))


def test_topics_are_chosen_by_a_regular_expression(graph, tmp_path):
    recorder = graph.add(Recorder, path=str(tmp_path / "bag"), regex="/leg_[0-9]/", exclude_regex="debug$")
    send = {name: graph.talk(name) for name in ("leg_1/state", "leg_2/state")}
    graph.probe.create_publisher(String, "leg_1/debug", 1)
    graph.probe.create_publisher(String, "arm/state", 1)
    graph.until(lambda: len(recorder._inputs) == 2 and not recorder.obstacles(), "two topics")
    for name in send:
        send[name](graph.joint_state(0, position=1.0))
    graph.until(lambda: sum(track.received for track in recorder._tracks.values()) == 2, "2 messages")
    finish(graph, recorder)
    assert set(read(tmp_path / "bag")) == {"/hopper/leg_1/state", "/hopper/leg_2/state"}


def test_a_weaker_publisher_that_joins_later_is_heard(graph, recording, tmp_path):
    recorder, say = recording()
    say(1.0)
    late = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
    graph.until(lambda: late.get_subscription_count() == 1, "a match")
    late.publish(graph.joint_state(time.time_ns(), position=2.0))
    graph.until(lambda: recorder._tracks["/hopper/joint_states"].received == 2, "2 messages")
    assert finish(graph, recorder)["lost"] == "0"
    assert [m.position[0] for m in read(tmp_path / "bag")["/hopper/joint_states"]] == [1.0, 2.0]


def test_what_does_not_fit_the_queue_is_dropped_and_counted(graph, tmp_path):
    recorder = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"], queue_size=1)
    send = graph.talk("joint_states")
    graph.until(lambda: not recorder.obstacles(), "readiness")
    for k in range(500):
        send(graph.joint_state(k * MS, position=0.0))
    graph.until(lambda: recorder._tracks["/hopper/joint_states"].received == 500, "500 messages")
    dropped = int(finish(graph, recorder)["dropped"])
    assert dropped > 0 and len(read(tmp_path / "bag")["/hopper/joint_states"]) == 500 - dropped


@pytest.mark.parametrize(("storage", "after"), [("mcap", 1.9), ("sqlite3", 0.3)])
def test_after_kill_9_at_most_a_second_and_a_half_is_lost_and_the_rest_identical(
    no_shared_memory, domain, tmp_path, storage, after
):
    losses = []
    while len(losses) < ATTEMPTS and not (losses and losses[-1].seconds <= 1.5):
        folder = tmp_path / str(len(losses))
        folder.mkdir()
        losses.append(kill(folder, storage, after))
    assert all(loss.identical for loss in losses) and losses[-1].seconds <= 1.5, losses


def test_a_disk_that_fills_up_is_told_in_one_line_and_what_was_written_is_recovered(graph, tmp_path):
    bag = tmp_path / "bag"
    process = graph.spawn("recorder", "recorder", path=str(bag), topics=["joint_states"], flush_period=0.1)
    send = graph.talk("joint_states")
    graph.until(lambda: bag.is_dir(), "the bag")
    sent = 0
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (50_000, 50_000))  # the system refuses to write more
    while process.returncode is None:
        send(graph.joint_state(time.time_ns(), position=float(sent := sent + 1)))
        graph.spin(0.0005)
    process.join_output()
    assert (
        process.returncode == 2
        and "File too large" in process.refusal
        and "rhythmid recover" in process.refusal
    )
    assert not any("Traceback" in line for line in graph.said)
    done = recover(bag, tmp_path / "recovered")
    kept = [m.position[0] for m in read(tmp_path / "recovered")["/hopper/joint_states"]]
    assert len(kept) > 200 and kept == list(range(int(kept[0]), int(kept[0]) + len(kept)))
    assert done.counts["/hopper/joint_states"] == len(kept)


def test_after_a_failure_of_the_writer_the_bag_holds_what_preceded(graph, recording, tmp_path):
    recorder, say = recording()
    say(1.0, 2.0)
    recorder._bag.put("/hopper/never_announced", 0, b"")
    graph.until(lambda: recorder.failure is not None, "the failure")
    with pytest.raises(KeyError):
        raise recorder.failure
    finish(graph, recorder)
    assert [m.position[0] for m in read(tmp_path / "bag")["/hopper/joint_states"]] == [1.0, 2.0]


def test_a_robots_own_message_types_are_recorded_with_their_definitions(tmp_path, monkeypatch):
    share = tmp_path / "share"
    (share / "ament_index/resource_index/packages").mkdir(parents=True)
    (share / "ament_index/resource_index/packages/my_robot").touch()
    (share / "my_robot/msg").mkdir(parents=True)
    (share / "my_robot/msg/Leg.msg").write_text("std_msgs/Header header\nToe[] toes\nfloat64 knee\n")
    (share / "my_robot/msg/Toe.msg").write_text("geometry_msgs/Vector3 force\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    bag = LiveBag(Storage(tmp_path / "bag"))
    bag.open()
    bag.add_topic("/leg", "my_robot/msg/Leg", [])
    with pytest.raises(InputError, match="my_robot/msg/Arm is not installed"):
        bag.add_topic("/arm", "my_robot/msg/Arm", [])
    bag.stop()
    with Reader(tmp_path / "bag") as reader:
        (connection,) = reader.connections
    assert connection.msgtype == "my_robot/msg/Leg" and "MSG: my_robot/Toe" in connection.msgdef.data


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({}, "path is missing"),
        ({"path": "{taken}"}, "exists already"),
        ({"path": "{file}/bag"}, "Not a directory"),
        ({"path": "{new}", "storage": "csv"}, "one of mcap, sqlite3"),
        ({"path": "{new}", "flush_period": 0.0}, r"\[0.1, 60\] s"),
        ({"path": "{new}", "regex": "("}, "regex = '\\(' is no regular expression"),
        ({"path": "{new}", "regex": ".", "time_mode": "lockstep"}, "in lockstep every topic must be named"),
        ({"path": "/proc/bag"}, "/proc/bag: "),
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
