"""What reaches the robot when processes die, are paused or are joined by strangers: real processes, real signals."""

import json
import math
import os
import signal
import time

import pytest
from patience import LONG, UNHURRIED
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from rhythmid.errors import InputError
from rhythmid_nodes.command_guard import CommandGuard
from rhythmid_nodes.qos import stream

CONSTANT = {"type": "profile", "points": [[0.0, 0.5]], "length": 60.0}
GUARD = {"max_effort": 1.0, "stale_after": 0.0}
RAMP = 2.0  # s in which a command fades: whoever sends it is not stalled for so long
pytestmark = pytest.mark.timeout(LONG)


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
    guard = graph.spawn("command_guard", "command_guard", **GUARD, command_ramp=RAMP)
    excitation = graph.spawn(
        "excitation", "excitation", {"excitation": "command"}, excitation=json.dumps(CONSTANT),
        max_effort=1.0, unattended=True, recorder="", stale_after=UNHURRIED,
    )  # fmt: skip
    graph.until(lambda: robot and robot[-1][1] == 0.5, "effort")
    return excitation, guard


def test_a_killed_commanders_effort_ends(no_shared_memory, excited, graph, robot):
    excitation, guard = excited
    os.kill(pid(excitation), signal.SIGKILL)
    graph.until(lambda: robot[-1][1] == 0.0, "zero effort")
    efforts = [effort for _, effort in robot]
    whole = len(efforts) - 1 - efforts[::-1].index(0.5)
    falling = efforts[whole:]
    assert falling == sorted(falling, reverse=True) and len(falling) > 2
    graph.until(lambda: any("not renewed within 0.1 s" in line for line in graph.said), "what it says")
    graph.until(lambda: time.monotonic() - robot[-1][0] > 1.0, "its silence")
    assert guard.returncode is None and robot[-1][1] == 0.0


def test_after_a_pause_the_newest_sample_is_sent_and_no_backlog(excited, graph, robot):
    excitation, _ = excited
    commands = graph.listen("command")
    graph.until(lambda: len(commands) > 10, "commands")
    os.kill(pid(excitation), signal.SIGSTOP)
    graph.until(lambda: robot[-1][1] == 0.0, "zero effort")
    paused = len(commands)
    os.kill(pid(excitation), signal.SIGCONT)
    graph.until(lambda: len(commands) > paused + 20, "commands after the pause")
    stamps = [message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec for message in commands]
    steps = [later - earlier for earlier, later in zip(stamps, stamps[1:], strict=False)]
    assert max(steps) > 0.5 * RAMP  # what was missed is left out
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
    graph.until(lambda: robot[-1][1] == 0.0, "zero effort")
    assert max(effort for _, effort in robot) <= 0.5


def test_a_guard_that_is_asked_to_end_leaves_zero_and_the_excitation_stops(excited, graph, robot):
    excitation, guard = excited
    os.kill(pid(guard), signal.SIGTERM)
    assert ended(graph, guard) == 0 and ended(graph, excitation) == 1
    graph.until(lambda: robot[-1][1] == 0.0, "zero effort")
    assert any("0 of 1 subscribers" in line for line in graph.said)


def test_size_rate_and_power_hold_whoever_commands(graph, robot):
    node = graph.add(
        CommandGuard, max_effort=2.0, max_effort_rate=10.0, max_power=0.4, stale_after=UNHURRIED
    )  # 0.4 W at 0.5 m/s: 0.8 N
    send = graph.talk("command")
    graph.until(lambda: node._watch.speed == 0.5, "a measurement")
    graph.probe.create_timer(0.002, lambda: send(graph.joint_state(time.time_ns(), effort=5.0)))
    graph.until(lambda: robot and robot[-1][1] == pytest.approx(0.8), "the largest effort")
    efforts = [0.0, *(effort for _, effort in robot)]
    steps = [abs(later - earlier) for earlier, later in zip(efforts, efforts[1:], strict=False)]
    assert max(steps) <= 10.0 * 1e-3 * (1 + 1e-9) and max(efforts) <= 0.8 + 1e-12
    assert int(node.figures()["limited_commands"]) > 10


def test_a_command_that_is_no_number_stops_the_guard(graph, robot):
    node = graph.add(CommandGuard, **GUARD, command_timeout=0.0)
    send = graph.talk("command")
    send(graph.joint_state(time.time_ns(), effort=0.3))
    graph.until(lambda: robot and robot[-1][1] == 0.3, "effort")
    send(graph.joint_state(time.time_ns(), effort=math.nan))
    graph.until(lambda: node.done and robot[-1][1] == 0.0, "the end")
    assert node.tripped == "a command of nan on /hopper/command"


def test_a_stop_is_logged_once_however_long_it_takes_to_end(graph, robot, capfd):
    node = graph.add(CommandGuard, max_effort=1.0, stale_after=0.5, command_timeout=0.0)
    send = graph.talk("command")
    graph.until(lambda: node._watch.speed == 0.5, "a measurement")
    send(graph.joint_state(time.time_ns(), effort=0.3))
    graph.until(lambda: robot and robot[-1][1] == 0.3, "effort")
    for timer in graph.probe.timers:
        timer.cancel()  # the robot stands still
    graph.until(lambda: node.done and robot[-1][1] == 0.0, "the end")
    graph.spin(0.1)
    log = "".join(capfd.readouterr())
    assert log.count("[ERROR]") == log.count("stopped: the newest measurement") == 1, log


def test_a_machine_in_danger_gets_no_effort_from_the_guard(graph, robot):
    node = graph.add(CommandGuard, max_effort=1.0, envelope=[0.0, 0.1])
    send = graph.talk("command")
    graph.probe.create_timer(0.002, lambda: send(graph.joint_state(time.time_ns(), effort=0.3)))
    graph.until(lambda: "outside the envelope" in "; ".join(node.obstacles()), "the danger")
    graph.until(lambda: int(node.figures()["commands"]) > 20, "commands")
    assert not robot


def test_the_guard_speaks_the_robots_type(graph):
    graph.add(
        CommandGuard, **GUARD, command_timeout=0.0, command_type="Float64MultiArray", command_topic="efforts",
        command_joints=["hip", "leg"],
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
    """A message that is sent during the pause has an effort that tells it; only the last of them may come."""
    injector = graph.spawn("delay_injector", "injector", delay=0.01, catch_up=1.0)
    send, heard = graph.talk("input"), graph.listen("output")
    effort, given = 0.0, []

    def command():
        given.append(effort)
        send(graph.joint_state(time.time_ns(), effort=effort))

    graph.probe.create_timer(0.005, command)
    graph.until(lambda: len(heard) > 20, "messages")
    os.kill(pid(injector), signal.SIGSTOP)
    effort = 0.1
    graph.until(lambda: given.count(0.1) > 400, "commands during the pause")  # 2 s
    effort = 0.2
    os.kill(pid(injector), signal.SIGCONT)
    graph.until(lambda: heard[-1].effort[0] == 0.2, "the first command after the pause")
    # the newest of the backlog, and what had not been due yet
    assert sum(message.effort[0] == 0.1 for message in heard) <= 4
