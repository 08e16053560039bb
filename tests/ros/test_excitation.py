"""Excitation over real topics: plays what the experiment says, and stops by itself when the machine is not safe."""

import json
import re
import time
import tracemalloc

import numpy as np
import pytest
from patience import LONG, UNHURRIED
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, String

from rhythmid.errors import InputError
from rhythmid.excitation.sequence import build
from rhythmid.experiment import Safety, ramped
from rhythmid_nodes import waiting
from rhythmid_nodes.excitation import ExcitationNode
from rhythmid_nodes.qos import latched

CHIRP = {"type": "chirp", "amplitude": 0.5, "band": [1, 7], "sweep": 2.0}
CONSTANT = {"type": "profile", "points": [[0.0, 0.5]], "length": 60.0}
PERIOD_NS = 1_000_000
STALL = 3.0  # s, longer than a busy machine keeps a whole process from its work
pytestmark = pytest.mark.timeout(LONG)


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


class Robot:
    """Publishes measurements of a slow motion at 200 Hz, best effort as robots do, for as long as it is asked to."""

    def __init__(self, graph, qos=qos_profile_sensor_data):
        self.position = 0.15
        self.motion = 1e-4
        self.offset_ns = 0
        self.measured_at = 0.0
        self._graph = graph
        self._send = graph.talk("joint_states", qos=qos)
        self._timer = graph.probe.create_timer(0.005, self._measure)

    def _measure(self):
        self.measured_at, now_ns = time.monotonic(), time.time_ns()
        position = self.position + self.motion * np.sin(now_ns * 1e-9 % 1000.0)
        self._send(self._graph.joint_state(now_ns + self.offset_ns, position=position))

    def die(self):
        self._timer.cancel()


@pytest.fixture
def excite(graph):
    """An excitation with given parameters, what it publishes, what `run` says, and a robot."""

    def make(spec=CONSTANT, **parameters):
        parameters = {
            "max_effort": 1.0,
            "excitation": json.dumps(spec),
            "stale_after": UNHURRIED,
            **parameters,
        }
        node = graph.add(ExcitationNode, **parameters)
        return node, graph.listen("excitation"), graph.listen("run", String, latched()), Robot(graph)

    return make


def start(graph):
    def started():
        return graph.call("excitation/start").success

    graph.until(started, "start")


def last_state(run):
    return json.loads(run[-1].data) if run else {}


def test_it_plays_the_experiments_samples_on_a_grid_without_gaps(graph, excite):
    _, heard, run, _ = excite(CHIRP, ramp=0.1, count=500, catch_up=10.0)
    start(graph)
    graph.until(lambda: last_state(run).get("state") == "finished", "the end")
    graph.until(lambda: len(heard) == 501, "501 samples")
    stamps = np.array([stamp_ns(message) for message in heard])
    assert np.all(np.diff(stamps) == PERIOD_NS) and stamps[0] % PERIOD_NS == 0
    assert stamps[0] == last_state(run)["start_ns"]
    grid = np.arange(500, dtype=np.int64) * PERIOD_NS * np.float64(1e-9)
    expected = ramped(build(CHIRP), Safety(max_effort=1.0, ramp=0.1), grid, 0.5)
    assert np.array_equal([message.effort[0] for message in heard[:-1]], expected)
    assert heard[-1].effort[0] == 0.0


def test_it_does_not_start_before_there_is_a_measurement_and_says_where_it_looks(graph, monkeypatch, capfd):
    monkeypatch.delenv("RHYTHMID_SUPERVISOR")  # who would say it
    monkeypatch.setattr(waiting, "FIRST", 0.1)
    said = "no measurement of joint leg on /arm/axes yet"
    graph.add(
        ExcitationNode, {"joint_states": "/arm/axes"}, max_effort=1.0, excitation=json.dumps(CONSTANT),
        unattended=True,
    )  # fmt: skip
    heard = graph.listen("excitation")
    graph.until(lambda: graph.nodes[0]._output.publisher.get_subscription_count() == 1, "a subscriber")
    answer = graph.call("excitation/start")
    assert not answer.success and answer.message == f"/hopper/recorder is not active; {said}"
    graph.spin(0.1)
    assert not heard
    log = ""

    def told():
        nonlocal log
        log += "".join(capfd.readouterr())
        return "waiting: " in log

    graph.until(told, "what it waits for")
    assert said in log and "/hopper/recorder is not active" in log


def test_it_does_not_start_before_everybody_listens(graph, excite):
    excite(subscribers=2)

    def told():
        answer = graph.call("excitation/start")
        assert not answer.success
        return "1 of 2 subscribers" in answer.message

    graph.until(told, "the subscriber that is there")


def test_it_does_not_start_outside_the_envelope(graph, excite):
    *_, robot = excite(envelope=[0.0, 0.1])

    def told():
        answer = graph.call("excitation/start")
        assert not answer.success
        return "outside the envelope" in answer.message

    graph.until(told, "the envelope")
    robot.position = 0.05
    start(graph)


def test_stale_measurements_stop_it(graph, excite):
    _, heard, run, robot = excite(stale_after=STALL)
    start(graph)
    graph.until(lambda: len(heard) > 50, "samples")
    robot.die()
    graph.until(lambda: last_state(run).get("state") == "stopped", "the stop")
    assert time.monotonic() - robot.measured_at > STALL
    assert f"allowed are {STALL:g} s" in last_state(run)["reason"]
    graph.until(lambda: heard[-1].effort[0] == 0.0, "the last command")
    number = len(heard)
    assert graph.silence(heard) == number
    assert heard[-2].effort[0] == 0.5  # no fading: it stops at once


@pytest.mark.parametrize("position", [0.5, -0.1, float("nan")])
def test_leaving_the_envelope_stops_it(graph, excite, position):
    _, heard, run, robot = excite(envelope=[0.0, 0.4])
    start(graph)
    graph.until(lambda: len(heard) > 50, "samples")
    robot.position = position
    graph.until(lambda: last_state(run).get("state") == "stopped", "the stop")
    assert "envelope" in last_state(run)["reason"]
    graph.until(lambda: heard[-1].effort[0] == 0.0, "the last command")


@pytest.mark.parametrize(
    ("parameters", "fault", "said"),
    [
        ({"stale_after": 60.0}, {"offset_ns": -100 * 10**9}, "stamped 10"),
        ({"max_gap": 60.0}, {"offset_ns": 100 * 10**9}, "step by 10"),
        ({"frozen_after": 1.0}, {"motion": 0.0}, "exactly 0.15 m"),
        ({"max_speed": 3.0}, {"position": 1e6}, "exceeds 3 m/s"),
    ],
)
def test_measurements_that_cannot_be_trusted_stop_it_with_exit_code_1(graph, excite, parameters, fault, said):
    node, heard, run, robot = excite(**parameters)
    start(graph)
    graph.until(lambda: len(heard) > 20, "samples")
    for name, value in fault.items():
        setattr(robot, name, value)
    graph.until(lambda: last_state(run).get("state") == "stopped", "the stop")
    assert said in last_state(run)["reason"] and said in node.tripped
    graph.until(lambda: heard[-1].effort[0] == 0.0, "the last command")


def test_it_stops_when_its_only_subscriber_leaves(graph):
    node = graph.add(ExcitationNode, max_effort=1.0, excitation=json.dumps(CONSTANT), stale_after=UNHURRIED)
    run = graph.listen("run", String, latched())
    listener = graph.probe.create_subscription(JointState, "excitation", lambda _: None, 10)
    Robot(graph)
    start(graph)
    graph.until(lambda: int(node.figures()["sent"]) > 20, "samples")
    graph.probe.destroy_subscription(listener)
    graph.until(lambda: last_state(run).get("state") == "stopped", "the stop")
    assert node.tripped == "0 of 1 subscribers of /hopper/excitation"


def test_a_second_publisher_stops_it_and_is_named(graph, excite):
    node, heard, run, _ = excite()
    start(graph)
    graph.until(lambda: len(heard) > 20, "samples")
    publisher = graph.probe.create_publisher(JointState, "excitation", 10)
    graph.until(lambda: last_state(run).get("state") == "stopped", "the stop")
    assert "2 publishers of /hopper/excitation: /hopper/excitation, /hopper/probe" in node.tripped
    answer = graph.call("excitation/start")
    assert not answer.success and "2 publishers" in answer.message
    graph.probe.destroy_publisher(publisher)
    start(graph)
    assert not node.tripped


def test_two_graphs_in_one_domain_see_each_other(graph, excite, capfd):
    node, *_ = excite()
    other = Node("excitation", namespace="/lab/other")
    graph.until(lambda: node.figures()["other_graphs"] == "/lab/other", "the other graph")
    other.destroy_node()
    assert "another graph is in this DDS domain: /lab/other" in capfd.readouterr().err


def test_the_stop_service_fades_out_and_start_plays_anew(graph, excite):
    _, heard, run, _ = excite(ramp=1.0)
    start(graph)
    graph.until(lambda: heard and heard[-1].effort[0] == 0.5, "the whole effort")
    assert not graph.call("excitation/start").success
    assert graph.call("excitation/stop").success
    graph.until(lambda: last_state(run).get("state") == "stopped", "the stop")
    graph.until(lambda: heard[-1].effort[0] == 0.0, "the last command")
    effort = np.array([message.effort[0] for message in heard])
    assert last_state(run)["reason"] == "asked to stop"
    fading = effort[np.flatnonzero(effort == 0.5)[-1] :]
    assert np.all(np.diff(fading) <= 0.0) and len(fading) > 2
    assert not graph.call("excitation/stop").success
    number = len(heard)
    start(graph)
    graph.until(lambda: len(heard) > number + 50, "samples of the second run")
    graph.until(lambda: last_state(run)["state"] == "running", "what is said of it")


def test_the_effort_is_clamped(graph, excite):
    _, heard, _, _ = excite(max_effort=0.2)
    start(graph)
    graph.until(lambda: len(heard) > 50, "samples")
    assert {message.effort[0] for message in heard} == {0.2}


def test_a_node_that_is_ended_leaves_a_zero_behind_and_reports_no_error(graph, excite, capfd):
    node, heard, run, _ = excite()
    start(graph)
    graph.until(lambda: len(heard) > 50, "samples")
    graph.nodes.remove(node)
    node.close()
    log = "".join(capfd.readouterr())
    assert re.search(r"\[INFO\].* the node was ended .*; the effort is zero at once", log), log
    assert "[ERROR]" not in log
    graph.until(lambda: heard[-1].effort[0] == 0.0, "the last command")
    graph.until(lambda: "ended" in last_state(run).get("reason", ""), "the reason")
    graph.executor.remove_node(node)
    node.destroy_node()


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"excitation": "no json"}, "not JSON"),
        ({"excitation": "[1]"}, "JSON object"),
        ({"excitation": '{"type": "chirps"}'}, "chirps"),
        (
            {"excitation": json.dumps(CHIRP), "max_effort": -1.0},
            r"max_effort = -1.0 must lie in \[0, inf\] N",
        ),
        ({"excitation": json.dumps(CHIRP), "envelope": [0.4, 0.0]}, "low < high"),
        ({"excitation": json.dumps(CHIRP), "rate": 0}, "rate = 0"),
        ({"excitation": json.dumps(CHIRP), "ramp": "long"}, "ramp = 'long' must be a number"),
        ({"excitation": json.dumps(CHIRP), "max_efort": 1.0}, "unknown parameter max_efort"),
    ],
)
def test_what_cannot_work_is_refused(graph, parameters, said):
    with pytest.raises(InputError, match=said):
        graph.add(ExcitationNode, **parameters)


@pytest.mark.parametrize(
    ("kind", "parameters", "expected"),
    [
        (Float64, {}, 0.5),
        (Float64MultiArray, {}, [0.5]),
        (Float64MultiArray, {"command_joints": ["hip", "leg", "toe"]}, [0.0, 0.5, 0.0]),
    ],
)
def test_it_speaks_the_command_type_of_the_robot_on_its_topic(graph, kind, parameters, expected):
    heard = graph.listen("effort_commands", kind)
    graph.add(
        ExcitationNode, max_effort=1.0, excitation=json.dumps(CONSTANT), command_type=kind.__name__,
        command_topic="effort_commands", stale_after=UNHURRIED, **parameters,
    )  # fmt: skip
    Robot(graph)
    start(graph)
    graph.until(lambda: len(heard) > 20, "commands")
    found = heard[10].data
    assert (list(found) if kind is Float64MultiArray else found) == expected


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        (
            {"command_type": "Float64MultiArray", "command_joints": ["hip"]},
            "the joint 'leg' is not among them",
        ),
        ({"command_type": "Float64", "time_mode": "lockstep"}, "a command needs a stamp; use JointState"),
    ],
)
def test_a_command_that_cannot_be_made_is_refused(graph, parameters, said):
    with pytest.raises(InputError, match=said):
        graph.add(ExcitationNode, max_effort=1.0, excitation=json.dumps(CONSTANT), **parameters)


def test_a_report_of_a_long_excitation_does_not_copy_it(excite):
    """A copy of an hour of commands takes tens of milliseconds, in which no measurement is read."""
    node, *_ = excite({**CONSTANT, "length": 600.0})
    tracemalloc.start()
    node.figures()
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 0.1 * node._effort.nbytes
