"""What nodes say in their log and refusals: units, the joints that are there, what is played, and each fault once."""

import json
import math
import time

import pytest
from patience import UNHURRIED
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from rhythmid.errors import InputError
from rhythmid_nodes.authority import UNNAMED
from rhythmid_nodes.command_guard import PARAMETERS, CommandGuard
from rhythmid_nodes.excitation import ExcitationNode
from rhythmid_nodes.joint_state import JointStateReader
from rhythmid_nodes.sample import Sample
from rhythmid_nodes.watch import Limits, Watch

BRIEF = {"type": "profile", "points": [[0.0, 0.5]], "length": 0.05}
RATE = next(one for one in PARAMETERS if one.name == "rate")


@pytest.mark.parametrize(
    ("position", "velocity", "said"),
    [(math.nan, 0.0, "position nan rad is outside the envelope [-1, 1] rad"), (0.0, 9.0, "9 rad/s exceeds 8 rad/s"),
     (0.0, 0.0, "exactly 0 rad for")],
)  # fmt: skip
def test_messages_bear_the_unit_of_the_joint(position, velocity, said):
    watch = Watch(Limits(stale_after=60.0, low=-1.0, high=1.0, speed=8.0, frozen_after=0.5, unit="rad"))
    for now in (0, 10**9):
        watch.hear(Sample(now, position, velocity, math.nan), now)
    assert said in watch.danger(10**9)


@pytest.mark.parametrize(("given", "meant"), [(500.0, 500), (500, 500)])
def test_a_whole_number_may_be_written_with_a_point(given, meant):
    value = RATE.check(given)
    assert value == meant and type(value) is int


@pytest.mark.parametrize("given", [500.5, math.inf, True, "500"])
def test_what_is_no_whole_number_is_refused(given):
    with pytest.raises(InputError, match="rate"):
        RATE.check(given)


def test_a_misspelt_parameter_gets_the_name_that_is_meant(graph):
    with pytest.raises(InputError, match=r"unknown parameter max_efort; did you mean max_effort\?$"):
        graph.add(CommandGuard, max_efort=1.0)


def test_a_wrong_joint_is_told_with_the_joints_that_are_there_and_a_guard_that_waits(graph):
    guard = graph.add(CommandGuard, {"command": "excitation"}, joint="elbow", max_effort=1.0)
    node = graph.add(ExcitationNode, joint="elbow", excitation=json.dumps(BRIEF), max_effort=1.0)
    states = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
    graph.probe.create_timer(
        0.02, lambda: states.publish(JointState(name=["hip", "knee"], position=[0.0, 0.0]))
    )
    expected = "no measurement of joint elbow on /hopper/joint_states yet; the messages there name hip, knee"
    for waiting in (guard, node):
        graph.until(lambda one=waiting: expected in one.obstacles(), "the joints")
    said = "0 of 1 subscribers of /hopper/excitation (/hopper/command_guard subscribes when the robot receives its commands)"
    assert said in node.obstacles()


def test_the_start_and_the_end_of_a_run_are_one_line_each(graph, monkeypatch, capfd):
    monkeypatch.delenv("RHYTHMID_SUPERVISOR")  # whose progress bar says it
    node = graph.add(
        ExcitationNode,
        excitation=json.dumps(BRIEF),
        max_effort=1.0,
        stale_after=UNHURRIED,
        unattended=True,
        recorder="",
    )
    graph.listen("excitation")
    states = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
    graph.probe.create_timer(0.01, lambda: states.publish(graph.joint_state(time.time_ns(), position=0.1)))
    graph.until(lambda: node.done, "the end")
    log = [line.partition("]: ")[2] for line in "".join(capfd.readouterr()).splitlines() if "[INFO]" in line]
    assert log == [
        "excitation starts: profile, 0.05 s, no recorder is active", "excitation finished: 50 samples, 0.05 s"
    ]  # fmt: skip


def test_an_unnamed_node_is_told_once_by_its_name(graph, capfd):
    node = graph.add(CommandGuard, max_effort=1.0)
    node.trip(f"2 publishers of /hopper/command: {UNNAMED} 0123, /hopper/excitation")
    node.trip("2 publishers of /hopper/command: /hopper/excitation, /lab/rogue")
    node.trip("a later fault")
    log = "".join(capfd.readouterr())
    assert (
        log.count("[ERROR]") == 1
        and "stopped: 2 publishers of /hopper/command: /hopper/excitation, /lab/rogue" in log
    )
    assert "/lab/rogue" in node.tripped


def test_an_unnamed_node_that_gets_no_name_is_told_at_the_end(graph, capfd):
    node = graph.add(CommandGuard, max_effort=1.0)
    node.trip(f"2 publishers of /hopper/command: {UNNAMED} 0123")
    node.close()
    assert "".join(capfd.readouterr()).count(UNNAMED) == 1


def test_the_joints_of_a_message_are_read_from_its_bytes(graph):
    heard = []
    graph.probe.create_subscription(JointState, "joint_states", heard.append, 10, raw=True)
    graph.talk("joint_states")(JointState(name=["hip", "knee"], position=[0.0, 0.0]))
    graph.until(lambda: heard, "the message")
    assert JointStateReader.names(heard[0]) == ["hip", "knee"]
