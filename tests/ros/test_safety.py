"""What reaches the robot when processes die, are paused or are joined by strangers: real processes, real signals."""

import json
import math
import os
import signal
import time

import pytest
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from rhythmid.errors import InputError
from rhythmid_nodes.command_guard import CommandGuard
from rhythmid_nodes.qos import stream

CONSTANT = {"type": "profile", "points": [[0.0, 0.5]], "length": 60.0}
GUARD = {"max_effort": 1.0, "stale_after": 0.0}
pytestmark = pytest.mark.timeout(120)


def pid(process):
    return process._process.pid


def ended(graph, process):
    graph.until(lambda: process.returncode is not None, f"end of {process.name}")
    process.join_output()
    return process.returncode


@pytest.fixture
def robot(graph):
    """A swinging robot that measures at 200 Hz, and the efforts that it hears with when they came."""
    heard = []
    graph.probe.create_subscription(
        JointState, "robot/command", lambda message: heard.append((time.monotonic(), message.effort[0])),
        stream(lockstep=False),
    )  # fmt: skip
    states = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)

    def measure():
        position = 0.15 + 0.01 * math.sin(time.monotonic())
        states.publish(graph.joint_state(time.time_ns(), position=position, velocity=0.5))

    graph.probe.create_timer(0.005, measure)
    return heard


@pytest.fixture
def excited(graph, robot):
    """An excitation and a guard, each a process of its own, and the effort of 0.5 N that flows to the robot."""
    guard = graph.spawn("command_guard", "command_guard", **GUARD)
    excitation = graph.spawn(
        "excitation", "excitation", {"excitation": "command"}, excitation=json.dumps(CONSTANT),
        max_effort=1.0, unattended=True,
    )  # fmt: skip
    graph.until(lambda: robot and robot[-1][1] == 0.5, "effort", timeout=40.0)
    return excitation, guard


def test_a_killed_commanders_effort_ends(no_shared_memory, excited, graph, robot):
    excitation, guard = excited
    os.kill(pid(excitation), signal.SIGKILL)
    graph.until(lambda: robot[-1][1] == 0.0, "zero effort", timeout=5.0)
    falling = [effort for _, effort in robot if 0.0 < effort < 0.5]
    assert falling == sorted(falling, reverse=True) and falling
    graph.until(lambda: any("not renewed within 0.1 s" in line for line in graph.said), "what it says")
    graph.spin(0.7)
    number = len(robot)
    graph.spin(0.3)
    assert guard.returncode is None and len(robot) == number and robot[-1][1] == 0.0  # then it is silent


def test_after_a_pause_the_newest_sample_is_sent_and_no_backlog(excited, graph, robot):
    excitation, _ = excited
    commands = graph.listen("command")
    graph.until(lambda: len(commands) > 10, "commands")
    os.kill(pid(excitation), signal.SIGSTOP)
    graph.spin(0.4)
    assert robot[-1][1] == 0.0
    paused = len(commands)
    os.kill(pid(excitation), signal.SIGCONT)
    graph.until(lambda: len(commands) > paused + 20, "commands after the pause")
    stamps = [message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec for message in commands]
    steps = [later - earlier for earlier, later in zip(stamps, stamps[1:], strict=False)]
    assert max(steps) > 0.3  # what was missed is left out
    graph.until(lambda: robot[-1][1] == 0.5, "effort again")


def test_a_second_commander_stops_the_guard_and_is_named(excited, graph, robot):
    excitation, guard = excited
    stranger = Node("stranger", namespace="/elsewhere")
    publisher = stranger.create_publisher(JointState, "/hopper/command", stream(lockstep=False))
    graph.until(lambda: publisher.get_subscription_count() > 0, "a listener")
    for _ in range(50):
        publisher.publish(graph.joint_state(time.time_ns(), effort=5.0))
    assert ended(graph, guard) == 1
    stranger.destroy_node()
    assert any("2 publishers of /hopper/command: /elsewhere/stranger" in line for line in graph.said)
    assert ended(graph, excitation) == 1  # it has stopped early, too
    assert robot[-1][1] == 0.0 and max(effort for _, effort in robot) <= 0.5


def test_a_guard_that_is_asked_to_end_leaves_zero_and_the_excitation_stops(excited, graph, robot):
    excitation, guard = excited
    os.kill(pid(guard), signal.SIGTERM)
    assert ended(graph, guard) == 0 and ended(graph, excitation) == 1
    assert robot[-1][1] == 0.0
    assert any("0 of 1 subscribers" in line for line in graph.said)


def test_size_rate_and_power_hold_whoever_commands(graph, robot):
    node = graph.add(
        CommandGuard, max_effort=2.0, max_effort_rate=10.0, max_power=0.4
    )  # 0.4 W at 0.5 m/s: 0.8 N
    send = graph.talk("command")
    graph.spin(0.1)
    graph.probe.create_timer(0.002, lambda: send(graph.joint_state(time.time_ns(), effort=5.0)))
    graph.until(lambda: robot and robot[-1][1] == pytest.approx(0.8), "the largest effort")
    efforts = [0.0, *(effort for _, effort in robot)]
    steps = [abs(later - earlier) for earlier, later in zip(efforts, efforts[1:], strict=False)]
    assert max(steps) <= 10.0 * 1e-3 * (1 + 1e-9) and max(efforts) <= 0.8 + 1e-12
    assert int(node.figures()["limited_commands"]) > 10


def test_a_command_that_is_no_number_stops_the_guard(graph, robot):
    node = graph.add(CommandGuard, **GUARD)
    send = graph.talk("command")
    send(graph.joint_state(time.time_ns(), effort=0.3))
    graph.until(lambda: robot and robot[-1][1] == 0.3, "effort")
    send(graph.joint_state(time.time_ns(), effort=math.nan))
    graph.until(lambda: node.done and robot[-1][1] == 0.0, "the end")
    assert node.tripped == "a command of nan on /hopper/command"


def test_a_machine_in_danger_gets_no_effort_from_the_guard(graph, robot):
    node = graph.add(CommandGuard, max_effort=1.0, envelope=[0.0, 0.1])
    send = graph.talk("command")
    graph.probe.create_timer(0.002, lambda: send(graph.joint_state(time.time_ns(), effort=0.3)))
    graph.spin(0.3)
    assert not robot and "outside the envelope" in "; ".join(node.obstacles())


def test_the_guard_speaks_the_robots_type(graph):
    graph.add(
        CommandGuard, **GUARD, command_type="Float64MultiArray", command_topic="efforts", command_joints=["hip", "leg"]
    )  # fmt: skip
    heard = graph.listen("efforts", Float64MultiArray)
    graph.talk("command")(graph.joint_state(time.time_ns(), effort=0.3))
    graph.until(lambda: heard, "commands")
    assert list(heard[0].data) == [0.0, 0.3]


@pytest.mark.parametrize(
    ("parameters", "said"),
    [({"time_mode": "lockstep"}, "no simulated time"), ({"envelope": [1.0, 0.0]}, "low < high")],
)
def test_what_cannot_work_is_refused(graph, parameters, said):
    with pytest.raises(InputError, match=said):
        graph.add(CommandGuard, **GUARD, **parameters)


def test_a_paused_injector_releases_no_backlog(graph):
    injector = graph.spawn("delay_injector", "injector", delay=0.01)
    send, heard = graph.talk("input"), graph.listen("output")
    graph.probe.create_timer(0.005, lambda: send(graph.joint_state(time.time_ns(), effort=0.1)))
    graph.until(lambda: len(heard) > 20, "messages")
    os.kill(pid(injector), signal.SIGSTOP)
    graph.spin(0.5)
    number = len(heard)
    os.kill(pid(injector), signal.SIGCONT)
    graph.until(lambda: len(heard) > number, "the first message after the pause")
    resumed = time.monotonic()
    graph.spin(0.2)
    elapsed = time.monotonic() - resumed
    assert len(heard) - number <= 1 + (elapsed + 0.1) / 0.005  # 100 have waited
