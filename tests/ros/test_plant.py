"""Plant over real topics: grid stamps without gaps, commands at their stamps, and nothing lost in lockstep."""

import errno
import os
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from patience import LONG
from std_msgs.msg import Header

from rhythmid.errors import InputError
from rhythmid.experiment import Forcing, Noise, plant_model
from rhythmid.model import Model
from rhythmid.simulation.plant import Plant
from rhythmid_nodes.lockstep import ACK_TOPIC
from rhythmid_nodes.plant import PlantNode
from rhythmid_nodes.qos import latched, stream

MODEL = Path(__file__).parents[2] / "analysis" / "rhythmid" / "models" / "paper_hopper.yaml"
PERIOD_NS = 1_000_000
POWER = 0.02  # W
pytestmark = pytest.mark.timeout(LONG)


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def reference(initial=(0.15, 0.0)):
    return Plant(plant_model(Model.load(MODEL), Forcing(), Noise()), PERIOD_NS, 0, initial)


def test_real_time_samples_lie_on_the_grid_without_gaps_and_follow_the_physics(graph):
    node = graph.add(PlantNode, model=str(MODEL), initial=[0.15, 0.0], catch_up=10.0)
    states, forcing = graph.listen("plant/joint_states"), graph.listen("forcing")
    graph.until(lambda: len(states) > 300 and len(forcing) > 300, "300 samples")
    stamps = np.array([stamp_ns(message) for message in states])
    assert np.all(np.diff(stamps) == PERIOD_NS) and stamps[0] % PERIOD_NS == 0
    skipped = (stamps[0] - node._origin_ns) // PERIOD_NS
    expected = reference().advance((skipped + 299) * PERIOD_NS)
    for field in ("position", "velocity", "effort"):
        heard = [getattr(message, field)[0] for message in states[:300]]
        np.testing.assert_allclose(heard, getattr(expected, field)[skipped:], rtol=1e-12, atol=1e-12)


def test_with_a_priority_the_threads_that_receive_get_it_as_the_clock_does(graph, monkeypatch):
    given = {}
    monkeypatch.setattr(os, "sched_setscheduler", lambda thread, *asked: given.update({thread: asked}))
    node = graph.add(PlantNode, model=str(MODEL), priority=20)
    graph.until(lambda: int(node.figures()["samples"]) > 0, "samples")
    assert given[threading.main_thread().native_id] == (os.SCHED_FIFO, os.sched_param(20))
    assert len(given) > 1


def test_without_the_right_to_priority_it_runs_at_ordinary_priority_and_says_so(graph, monkeypatch, capsys):
    def refuse(*_):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    node = graph.add(PlantNode, model=str(MODEL), priority=20)
    graph.until(lambda: int(node.figures()["samples"]) > 10, "samples")
    assert "warning: no SCHED_FIFO priority 20: Operation not permitted" in capsys.readouterr().err


def test_a_command_acts_at_its_stamp_and_a_late_one_at_once(graph):
    node = graph.add(PlantNode, model=str(MODEL), command_timeout=0.0, catch_up=10.0, forcing_amplitude=0.0)
    states = graph.listen("plant/joint_states")
    send = graph.talk("command")
    graph.until(lambda: len(states) > 50, "samples")
    now = time.time_ns()
    send(graph.joint_state(now, effort=0.3))
    graph.until(lambda: node.figures()["commands"] == "1", "the command")
    graph.until(lambda: states[-1].effort[0] == 0.3, "samples under the command")
    send(graph.joint_state(now - 1_000_000_000, effort=0.7))
    graph.until(lambda: node.figures()["commands"] == "2", "the late command")
    assert int(node.figures()["late_commands"]) >= 1
    graph.until(lambda: states[-1].effort[0] == 0.7, "its effect")
    given = np.array([state.effort[0] for state in states])
    levels = given[np.concatenate([[True], np.abs(np.diff(given)) > 1e-9])]
    np.testing.assert_allclose(levels, [0.0, 0.3, 0.7], atol=1e-9)
    first = stamp_ns(states[int(np.argmax(given > 1e-9))])
    assert first >= now


def test_a_command_that_nobody_renews_fades_to_zero_and_is_counted(graph):
    node = graph.add(
        PlantNode,
        model=str(MODEL),
        command_timeout=0.1,
        command_ramp=0.02,
        catch_up=10.0,
        forcing_amplitude=0.0,
    )
    states = graph.listen("plant/joint_states")
    send = graph.talk("command")
    graph.until(lambda: len(states) > 50, "samples")
    now = time.time_ns()
    send(graph.joint_state(now, effort=0.3))
    graph.until(lambda: node.figures()["lapsed_commands"] == "1", "the lapse")
    lapsed = stamp_ns(states[-1])
    graph.until(lambda: stamp_ns(states[-1]) > lapsed + 0.3e9, "what follows")
    given = {stamp_ns(state): state.effort[0] for state in states}
    acting = [stamp for stamp, effort in given.items() if effort > 1e-9]
    held = [stamp for stamp in acting if given[stamp] > 0.3 - 1e-9]
    assert now <= acting[0] and 0.09e9 < held[-1] - held[0] < 0.1e9 + 2 * PERIOD_NS
    assert 0.015e9 < acting[-1] - held[-1] < 0.02e9
    assert abs(list(given.values())[-1]) < 1e-9


def test_a_command_beyond_the_limit_is_clamped(graph):
    node = graph.add(PlantNode, model=str(MODEL), max_effort=0.1, command_timeout=0.0, forcing_amplitude=0.0)
    states = graph.listen("plant/joint_states")
    graph.talk("command")(graph.joint_state(time.time_ns(), effort=-5.0))
    graph.until(lambda: node.figures()["clamped_commands"] == "1", "the command")
    graph.until(lambda: states and states[-1].effort[0] == -0.1, "its effect")


def test_size_rate_and_power_hold_whoever_commands_and_the_rest_of_a_step_follows(graph):
    node = graph.add(
        PlantNode, model=str(MODEL), max_effort=2.0, max_effort_rate=10.0, max_power=POWER, command_timeout=0.0,
        catch_up=10.0, forcing_amplitude=0.0, initial=[0.2, 0.0],
    )  # fmt: skip
    states = graph.listen("plant/joint_states")
    graph.talk("command")(graph.joint_state(time.time_ns(), effort=5.0))
    graph.until(lambda: node.figures()["commands"] == "1" and node._samples > 1000, "a second of motion")
    graph.until(lambda: len(states) > 500, "samples")
    effort, velocity = (
        np.array([getattr(state, field)[0] for state in states]) for field in ("effort", "velocity")
    )
    assert effort.max() > 0.05 and int(node.figures()["limited_commands"]) > 500
    # on a busy machine the queue of this listener overflows while the plant catches up
    stamps = np.array([state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec for state in states])
    steps = np.round(np.diff(stamps) * 1e3)
    assert np.abs(effort).max() <= 2.0 and np.all(np.diff(effort) <= 10.0 * 1e-3 * steps * (1.0 + 1e-9))
    power = np.minimum(np.abs(effort[2:] * velocity[1:-1]), np.abs(effort[2:] * velocity[:-2]))
    power = power[(steps[1:] == 1.0) & (steps[:-1] == 1.0)]
    assert power.max() <= POWER * (1.0 + 1e-9) and power.max() > 0.9 * POWER


def test_a_command_that_is_no_number_stops_the_plant(graph):
    node = graph.add(PlantNode, model=str(MODEL))
    graph.talk("command")(graph.joint_state(time.time_ns(), effort=float("nan")))
    graph.until(lambda: node.done, "the end")
    assert node.tripped == "a command of nan on /hopper/command"


def test_a_command_for_another_joint_is_counted_and_ignored(graph):
    node = graph.add(PlantNode, model=str(MODEL), joint="arm")
    send = graph.talk("command")
    send(graph.joint_state(time.time_ns(), effort=0.3))
    graph.until(lambda: node.figures()["commands_of_other_joints"] == "1", "the command")
    assert node.figures()["commands"] == "0"


def test_in_lockstep_it_goes_as_far_as_the_newest_command_and_the_credit_allow(graph):
    graph.add(
        PlantNode, model=str(MODEL), initial=[0.15, 0.0], time_mode="lockstep", window=5, count=40,
        consumers=["recorder"],
    )  # fmt: skip
    states = graph.listen("plant/joint_states", qos=stream(lockstep=True))
    acks = graph.listen(ACK_TOPIC, Header, latched())
    send = graph.talk("command", qos=stream(lockstep=True))
    acknowledge = graph.talk(ACK_TOPIC, Header, latched())
    graph.spin(0.1)
    assert not states  # no command is known yet
    send(graph.joint_state(20 * PERIOD_NS + 300_000, effort=0.1))
    graph.until(lambda: len(states) == 5, "the first window")
    graph.spin(0.1)
    assert len(states) == 5  # commands are known up to 20.3 ms, but nobody has taken the samples in
    for done in range(5, 45, 5):
        header = Header(frame_id="recorder")
        header.stamp.nanosec = done * PERIOD_NS
        acknowledge(header)
    graph.until(lambda: len(states) == 21, "samples 0 to 20")
    for k in range(21, 60):
        send(graph.joint_state(k * PERIOD_NS, effort=0.1))
    graph.until(lambda: len(states) == 40, "all samples")
    graph.spin(0.1)
    assert [stamp_ns(message) for message in states] == [k * PERIOD_NS for k in range(40)]
    plant = reference()
    plant.push(20 * PERIOD_NS + 300_000, 0.1)
    expected = plant.advance(39 * PERIOD_NS)
    assert [message.position[0] for message in states] == expected.position.tolist()
    assert {ack.frame_id for ack in acks} >= {"plant"}


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({}, "model is missing"),
        ({"model": "missing.yaml"}, "missing.yaml"),
        ({"model": str(MODEL), "initial": [0.1]}, "position .* velocity"),
        ({"model": str(MODEL), "noise_std": -1.0}, "noise_std = -1.0 must lie in"),
        ({"model": str(MODEL), "time_mode": "warp"}, "one of realtime, lockstep"),
        ({"model": str(MODEL), "time_mode": "lockstep"}, "count = 0"),
        (
            {"model": str(MODEL), "time_mode": "lockstep", "count": 9, "max_power": 1.0},
            "in lockstep only the size",
        ),
    ],
)
def test_what_cannot_work_is_refused(graph, parameters, said):
    with pytest.raises(InputError, match=said):
        graph.add(PlantNode, **parameters)
