"""An excitation whose recorder or receiver dies during the run: it stops, says so in one line, and its process ends with code 1."""

import json
import threading
import time

import pytest
from patience import LONG, UNHURRIED
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from rhythmid_nodes import node_state
from rhythmid_nodes.command_guard import CommandGuard
from rhythmid_nodes.excitation import ExcitationNode
from rhythmid_nodes.qos import latched, stream

CONSTANT = {"type": "profile", "points": [[0.0, 0.5]], "length": 600.0}
pytestmark = pytest.mark.timeout(LONG)


class Companion:
    """A managed node that can be stopped as SIGSTOP or SIGKILL stop a process: the middleware still knows it, and it answers nothing."""

    def __init__(self, name):
        self.node = LifecycleNode(name, namespace="/hopper")
        self.node.trigger_configure()
        self.node.trigger_activate()
        self._executor = EventsExecutor()
        self._executor.add_node(self.node)
        self._dead = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self):
        while not self._dead.is_set():
            self._executor.spin_once(timeout_sec=0.02)

    def die(self):
        self._dead.set()
        self._thread.join()

    def close(self):
        self.die()
        self._executor.shutdown()
        self.node.destroy_node()


class Excited:
    """An excitation that plays, and its companions."""

    def __init__(self, graph, companions, **parameters):
        self.graph, self.companions = graph, companions
        self.node = graph.add(
            ExcitationNode, excitation=json.dumps(CONSTANT), max_effort=1.0, ramp=0.2, stale_after=UNHURRIED,
            **parameters,
        )  # fmt: skip
        self._run = graph.listen("run", String, latched())
        states = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
        graph.probe.create_timer(
            0.01, lambda: states.publish(graph.joint_state(time.time_ns(), position=0.1))
        )

    @property
    def state(self):
        return json.loads(self._run[-1].data) if self._run else {}

    def play(self):
        self.graph.until(lambda: self.node._state == "running" or not self.node._start(), "the start")
        sent = self.node._sent
        self.graph.until(lambda: self.node._sent > sent + 20, "samples")


@pytest.fixture
def excited(graph, monkeypatch):
    monkeypatch.delenv("RHYTHMID_SUPERVISOR")  # who would look after the recorder
    monkeypatch.setattr(node_state, "PATIENCE", 0.5)
    made = []

    def make(*names, **parameters):
        made.extend(map(Companion, names))
        return Excited(graph, made, **parameters)

    yield make
    for companion in made:
        companion.close()


@pytest.mark.parametrize(
    ("how", "unattended", "said"),
    [("killed", True, "has not answered for 0.5 s"), ("deactivated", False, "is not active")],
)
def test_without_its_recorder_it_fades_out_and_fails(excited, graph, capfd, how, unattended, said):
    run = excited("recorder", unattended=unattended)
    heard = graph.listen("excitation")
    graph.until(lambda: run.node._companions.recorder.active, "an active recorder")
    run.play()
    recorder = run.companions[0]
    if how == "killed":
        recorder.die()
    else:
        recorder.node.trigger_deactivate()
    graph.until(lambda: run.state.get("state") == "stopped", "the stop")
    reason = f"nothing is recorded any more: /hopper/recorder {said}"
    assert run.state["reason"] == run.node.tripped == reason  # a node with a reason ends with exit code 1
    graph.until(lambda: heard[-1].effort[0] == 0.0, "zero effort")
    efforts = [message.effort[0] for message in heard]
    falling = efforts[len(efforts) - efforts[::-1].index(0.5) :]
    assert len(falling) > 100 and falling == sorted(
        falling, reverse=True
    )  # it fades: 200 samples unless stalled
    log = "".join(capfd.readouterr())
    assert log.count("nothing is recorded any more") == 1
    if unattended:
        graph.until(lambda: run.node.done, "the end of the process")  # without anybody's order


def test_who_starts_it_without_a_recorder_or_names_none_is_not_stopped(excited, graph):
    run = excited("stranger", recorder="")
    graph.listen("excitation")
    run.play()
    run.node._look_for_company()
    assert run.node._companions.unrecorded == "" and run.node._state == "running"


def test_a_killed_receiver_stops_it_even_if_a_recorder_still_listens(excited, graph):
    run = excited("recorder", "guard")
    recorder, guard = (companion.node for companion in run.companions)
    for node in (recorder, guard):
        node.create_subscription(JointState, "excitation", lambda _: None, stream(lockstep=False))
    recorder.create_service(node_state.GetState, "~/split_bagfile", lambda _request, answer: answer)
    run.play()
    receivers = run.node._companions._receivers
    graph.until(lambda: "/hopper/guard" in receivers and receivers["/hopper/guard"].active, "its answer")
    run.companions[1].die()
    graph.until(lambda: run.state.get("state") == "stopped", "the stop")
    assert "no subscriber of /hopper/excitation" in run.node.tripped
    assert "/hopper/guard has not answered for 0.5 s" in run.node.tripped


def test_a_guard_that_is_being_ended_does_not_blame_the_robot(graph):
    """While it waits for its last message to be received it hears no measurements."""
    node = graph.add(CommandGuard, max_effort=1.0, stale_after=0.3, command_timeout=0.0)
    efforts, send = graph.listen("robot/command"), graph.talk("command")
    states = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
    timer = graph.probe.create_timer(
        0.005, lambda: states.publish(graph.joint_state(time.time_ns(), position=0.1))
    )

    def commanded():
        send(graph.joint_state(time.time_ns(), effort=0.5))
        return efforts and efforts[-1].effort[0] == 0.5

    graph.until(commanded, "effort")
    timer.cancel()
    node.stand_down()
    time.sleep(0.5)  # no callback is served, and its clock ticks on
    assert not node.tripped
    graph.until(lambda: efforts[-1].effort[0] == 0.0, "zero effort")
