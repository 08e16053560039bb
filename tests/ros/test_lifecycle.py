"""Managed nodes over real topics and the standard services: what each does in its states, and what comes of the effort."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from patience import LONG, PATIENCE
from rclpy.qos import qos_profile_sensor_data
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import JointState

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform
from rhythmid_nodes.command_guard import CommandGuard
from rhythmid_nodes.compose import EXECUTABLES
from rhythmid_nodes.delay_injector import DelayInjector
from rhythmid_nodes.excitation import ExcitationNode
from rhythmid_nodes.joint_state import JointStateReader
from rhythmid_nodes.plant import PlantNode
from rhythmid_nodes.recorder import Recorder

MODEL = Path(__file__).parents[2] / "analysis" / "rhythmid" / "models" / "paper_hopper.yaml"
LEG = MODEL.parent / "legs" / "leg_experiment.yaml"
CONSTANT = {"type": "profile", "points": [[0.0, 0.5]], "length": 60.0}
EXCITATION = {"max_effort": 1.0, "excitation": json.dumps(CONSTANT), "stale_after": 0.0}
pytestmark = pytest.mark.timeout(LONG)


def change(graph, node, label):
    """Whether a node has made a transition."""
    request = ChangeState.Request(transition=Transition(label=label))
    return graph.call(f"{node}/change_state", ChangeState, request).success


def state(graph, node):
    return graph.call(f"{node}/get_state", GetState).current_state.label


@pytest.fixture
def efforts(graph):
    """The efforts of `excitation`, and measurements without which it does not play."""
    heard = []
    graph.probe.create_subscription(
        JointState, "excitation", lambda message: heard.append(message.effort[0]), 1000
    )
    states = graph.probe.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
    graph.probe.create_timer(
        0.005,
        lambda: states.publish(graph.joint_state(time.time_ns(), position=0.15 + 0.01 * np.sin(time.time()))),
    )
    return heard


def parameters(name, folder):
    """What a node of each kind needs to be configured."""
    return {
        "plant": {"model": str(MODEL)},
        "excitation": EXCITATION,
        "delay_injector": {},
        "recorder": {"path": str(folder / "bag"), "topics": ["joint_states"]},
        "command_guard": {"max_effort": 1.0},
        "joint_plant": {"experiment": str(LEG)},
        "joint_excitation": {"experiment": str(LEG)},
    }[name]


@pytest.mark.parametrize("name", EXECUTABLES)
def test_every_node_goes_through_its_states_by_the_standard_services(graph, tmp_path, name):
    node = graph.add(EXECUTABLES[name], autostart=False, **parameters(name, tmp_path))
    called = node.get_name()
    assert state(graph, called) == "unconfigured" and node.obstacles is not None
    before = len(node._entities())
    for _ in range(1 if name == "recorder" else 2):  # a bag is not written twice
        assert not change(graph, called, "activate")  # no transition of this state, and the node lives
        assert change(graph, called, "configure") and state(graph, called) == "inactive"
        assert change(graph, called, "activate") and state(graph, called) == "active"
        assert change(graph, called, "deactivate") and state(graph, called) == "inactive"
        assert change(graph, called, "activate") and state(graph, called) == "active"
        assert change(graph, called, "deactivate")
        assert change(graph, called, "cleanup") and state(graph, called) == "unconfigured"
        assert len(node._entities()) == before
    assert change(graph, called, "shutdown") and state(graph, called) == "finalized" and node.done
    assert node.failure is None


def test_a_deactivated_excitation_has_faded_to_zero_when_it_answers_and_plays_again_when_activated(
    graph, efforts
):
    graph.add(ExcitationNode, **EXCITATION, ramp=1.0)
    graph.until(lambda: graph.call("excitation/start").success, "start")
    graph.until(lambda: efforts and efforts[-1] == 0.5, "effort")
    begun = len(efforts)
    assert change(graph, "excitation", "deactivate")
    graph.until(lambda: efforts[-1] == 0.0, "zero effort")
    fading = [effort for effort in efforts[begun:] if 0.0 < effort < 0.5]
    assert fading and fading == sorted(fading, reverse=True)
    number = len(efforts)
    assert state(graph, "excitation") == "inactive"
    answer = graph.call("excitation/start")
    assert not answer.success and answer.message == "not active" and not any(efforts[number:])
    assert change(graph, "excitation", "activate")
    graph.until(lambda: graph.call("excitation/start").success, "start")
    graph.until(lambda: efforts[-1] == 0.5, "effort")


def test_a_deactivated_guard_gives_zero_until_it_is_activated(graph):
    graph.add(CommandGuard, max_effort=1.0, stale_after=0.0)
    heard = graph.listen("robot/command")
    send = graph.talk("command")
    states = graph.talk("joint_states", qos=qos_profile_sensor_data)
    graph.probe.create_timer(0.005, lambda: send(graph.joint_state(time.time_ns(), effort=0.3)))
    graph.probe.create_timer(0.005, lambda: states(graph.joint_state(time.time_ns(), position=0.15)))
    graph.until(lambda: heard and heard[-1].effort[0] == 0.3, "effort")
    assert change(graph, "command_guard", "deactivate")
    graph.until(lambda: heard[-1].effort[0] == 0.0, "zero effort")
    number = len(heard)
    graph.silence(heard)
    assert not any(message.effort[0] for message in heard[number:])
    assert change(graph, "command_guard", "activate")
    graph.until(lambda: heard[-1].effort[0] == 0.3, "effort")


def test_an_inactive_plant_stops_stepping_and_goes_on_where_it_was(graph):
    node = graph.add(PlantNode, model=str(MODEL), forcing_amplitude=0.0, initial=[0.2, 0.0])
    heard = graph.listen("plant/joint_states")
    graph.until(lambda: len(heard) > 50, "samples")
    assert change(graph, "plant", "deactivate")
    number, left_ns, samples = graph.silence(heard), node._done_ns, node._samples
    graph.spin(0.3)
    assert node._samples == samples and len(heard) == number
    assert change(graph, "plant", "activate")
    graph.until(lambda: len(heard) > number, "samples")
    first = heard[number]
    assert node._plant is not None and first.header.stamp.sec > 0
    expected = heard[number - 1].position[0] + heard[number - 1].velocity[0] * 1e-3
    assert first.position[0] == pytest.approx(expected, abs=1e-4)  # one sample on, not 400
    assert node._next_ns >= left_ns + node.period_ns


def test_an_inactive_injector_passes_nothing_on_and_keeps_nothing_back(graph):
    node = graph.add(DelayInjector, {"input": "here", "output": "there"})
    send, heard = graph.talk("here"), graph.listen("there")
    taken = []
    count = node._input._gaps.add
    node._input._gaps.add = lambda number: taken.append(count(number))
    send(graph.joint_state(time.time_ns(), effort=0.1))
    graph.until(lambda: heard, "a message")
    assert graph.set_parameter("delay_injector", "delay", 10.0).successful
    send(graph.joint_state(time.time_ns(), effort=0.2))
    graph.until(lambda: node.figures()["queued"] == "1", "a message held back")
    assert change(graph, "delay_injector", "deactivate")
    send(graph.joint_state(time.time_ns(), effort=0.3))
    graph.until(lambda: len(taken) == 3, "a message that is not passed on")
    assert graph.set_parameter("delay_injector", "delay", 0.0).successful
    assert change(graph, "delay_injector", "activate")
    send(graph.joint_state(time.time_ns(), effort=0.4))
    graph.until(lambda: len(heard) > 1, "a message")
    assert [message.effort[0] for message in heard] == [0.1, 0.4]


def test_an_inactive_recorder_records_nothing_and_goes_on_in_the_same_bag(graph, tmp_path):
    node = graph.add(Recorder, path=str(tmp_path / "bag"), topics=["joint_states"])
    send = graph.talk("joint_states")

    def record(effort):
        track = next(iter(node._tracks.values()))
        number = track.received
        send(graph.joint_state(time.time_ns(), effort=effort))
        graph.until(lambda: track.received > number, "the message")

    record(0.1)
    assert change(graph, "recorder", "deactivate")
    record(0.2)
    assert change(graph, "recorder", "activate")
    record(0.3)
    assert change(graph, "recorder", "shutdown")
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 2


def test_in_lockstep_simulated_time_waits_for_an_inactive_node_and_the_data_stay_the_same(graph, tmp_path):
    path = tmp_path / "experiment.yaml"
    path.write_text(yaml.safe_dump({
        "model": str(MODEL), "time": {"mode": "lockstep"}, "record": {"path": str(tmp_path / "bag")},
        "excitation": {"type": "chirp", "amplitude": 0.05, "band": [1, 7], "sweep": 5.0},
        "delays": {"input": 0.0403, "measurement": 0.0507},
    }))  # fmt: skip
    experiment = Experiment.load(path)
    built = {}
    for spec in experiment.nodes():
        given = {key: value for key, value in spec.parameters.items() if value != []}
        late = {"autostart": spec.name == "recorder"}

        def build(cli_args, name=spec.name, kind=EXECUTABLES[spec.executable], **options):
            return kind(cli_args=[*cli_args, "-r", f"__node:={name}"], **options)

        built[spec.name] = graph.add(build, spec.remappings, **{**given, **late})
    graph.until(
        lambda: change(graph, "excitation", "configure") and change(graph, "excitation", "activate"),
        "excitation",
    )
    for name in ("command_delay", "measurement_delay", "plant"):
        assert change(graph, name, "configure")
    graph.until(lambda: graph.call("excitation/start").success, "start")
    for name in ("command_delay", "measurement_delay", "plant"):
        assert change(graph, name, "activate")
    plant = built["plant"]
    for name in ("plant", "recorder", "command_delay", "excitation"):
        number = plant._samples
        graph.until(lambda at=number: plant._samples > at, "progress")
        assert change(graph, name, "deactivate")
        graph.spin(0.05)
        assert plant._samples < 5000
        assert change(graph, name, "activate")
    graph.until(lambda: built["recorder"]._ack._told == 5000, "the end")
    for node in built.values():
        node.close()
    expected = perform(experiment)["joint_states"].position
    joint = JointStateReader("leg")
    with Reader(tmp_path / "bag") as reader:
        kept = [c for c in reader.connections if c.topic == "/hopper/joint_states"]
        found = [joint.read(data).position for _, _, data in reader.messages(kept)]
    assert found == expected.tolist()


def test_an_unattended_start_waits_for_an_active_recorder(graph, efforts, tmp_path):
    graph.add(ExcitationNode, **EXCITATION, unattended=True)
    graph.spin(0.5)
    recorder = graph.add(Recorder, autostart=False, path=str(tmp_path / "bag"), topics=["excitation"])
    assert change(graph, "recorder", "configure")
    graph.spin(0.3)
    assert not efforts
    assert change(graph, "recorder", "activate")
    graph.until(lambda: len(efforts) > 20, "effort")
    graph.until(lambda: next(iter(recorder._tracks.values())).received, "the effort in the bag")


def test_use_sim_time_is_refused_in_one_line(graph):
    done = subprocess.run(
        [sys.executable, "-m", "rhythmid_nodes.delay_injector", "--ros-args", "-p", "use_sim_time:=true"],
        capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert "error: parameter use_sim_time = True" in done.stderr and "lockstep" in done.stderr
    graph.add(DelayInjector, {"input": "here", "output": "there"})
    answer = graph.set_parameter("delay_injector", "use_sim_time", True)
    assert not answer.successful and "/clock" in answer.reason


@pytest.mark.parametrize("label", ["configure", "shutdown"])
def test_who_ends_a_node_by_a_transition_gets_its_answer_although_it_was_busy(graph, label):
    spawned = graph.spawn("recorder", "recorder", autostart=False)
    assert state(graph, "recorder") == "unconfigured"
    client = graph.probe.create_client(ChangeState, "recorder/change_state")
    graph.until(client.service_is_ready, "the service")
    answer = client.call_async(ChangeState.Request(transition=Transition(label=label)))
    subprocess.run(
        ["sh", "-c", f"kill -STOP {os.getpid()}; sleep 0.5; kill -CONT {os.getpid()}"], check=True
    )  # the middleware of this process stands still, too
    graph.until(answer.done, "the answer")
    assert answer.result().success == (label == "shutdown")
    graph.until(lambda: spawned.returncode is not None, "the end")
    assert spawned.returncode == (2 if label == "configure" else 0)


def test_what_configure_refuses_ends_the_process_in_one_line(graph):
    spawned = graph.spawn("plant", "plant", autostart=False)
    assert state(graph, "plant") == "unconfigured"
    assert not change(graph, "plant", "configure")
    graph.until(lambda: spawned.returncode is not None, "the end")
    spawned.join_output()
    assert spawned.returncode == 2 and "parameter model is missing" in spawned.refusal
    with pytest.raises(InputError, match="model is missing"):
        graph.add(PlantNode)
