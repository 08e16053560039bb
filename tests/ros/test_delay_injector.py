"""Delay injector over real topics: exact in lockstep, never early in real time, order always kept."""

import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from patience import LONG
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String

from rhythmid.errors import InputError
from rhythmid.experiment import Delay
from rhythmid_nodes.delay_injector import DelayInjector
from rhythmid_nodes.joint_state import JointStateWriter
from rhythmid_nodes.qos import latched, stream

MS = 1_000_000
REMAP = {"input": "here", "output": "there"}
pytestmark = pytest.mark.timeout(LONG)


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


@pytest.mark.parametrize("delay", [0.0, 0.040, 0.0403, 0.050_000_001])
def test_in_lockstep_the_delay_is_exact_to_the_nanosecond(graph, delay):
    graph.add(DelayInjector, REMAP, time_mode="lockstep", delay=delay)
    heard = graph.listen("there")
    send = graph.talk("here", qos=stream(lockstep=True))
    for k in range(50):
        send(graph.joint_state(k * MS, effort=float(k)))
    graph.until(lambda: len(heard) == 50, "50 messages")
    assert [stamp_ns(message) for message in heard] == [k * MS + round(delay * 1e9) for k in range(50)]
    assert [message.effort[0] for message in heard] == list(range(50))


def test_in_lockstep_a_profile_is_followed_and_nothing_overtakes(graph, tmp_path: Path):
    table = tmp_path / "profile.csv"
    table.write_text("time,delay\n0.0,0.040\n0.02,0.060\n0.021,0.010\n")  # falls faster than time passes
    graph.add(DelayInjector, REMAP, time_mode="lockstep", profile=str(table))
    heard = graph.listen("there")
    send = graph.talk("here", qos=stream(lockstep=True))
    for k in range(60):
        send(graph.joint_state(k * MS, effort=float(k)))
    graph.until(lambda: len(heard) == 60, "60 messages")
    stamps = [stamp_ns(message) for message in heard]
    assert stamps == Delay(profile=table).release(np.arange(60) * MS).tolist()
    assert np.all(np.diff(stamps) > 0)
    assert [message.effort[0] for message in heard] == list(range(60))


def test_in_real_time_nothing_is_released_early_and_the_stamp_says_when(graph):
    node = graph.add(DelayInjector, REMAP, delay=0.040)
    heard = graph.listen("there")
    send = graph.talk("here")
    sent = []
    for k in range(100):
        sent.append(time.time_ns())
        send(graph.joint_state(sent[-1], effort=float(k)))
        graph.spin(0.002)
    graph.until(lambda: len(heard) == 100, "100 messages")
    assert [message.effort[0] for message in heard] == list(range(100))
    late = np.array([stamp_ns(message) for message in heard]) - np.array(sent) - 40 * MS
    assert np.all(late >= -MS // 10)  # the node's clock and this one were read one after the other
    figures = node.figures()
    assert figures["relayed"] == "100" and figures["dropped"] == "0"
    assert float(figures["applied_delay_mean_ms"]) == pytest.approx(40 + late.mean() / MS, abs=0.2)
    assert float(figures["delay_error_max_ms"]) == pytest.approx(late.max() / MS, abs=0.2)


def test_stamp_mode_keep_leaves_every_byte_alone(graph):
    graph.add(DelayInjector, REMAP, delay=0.005, stamp_mode="keep")
    heard = graph.listen("there")
    send = graph.talk("here")
    message = graph.joint_state(time.time_ns(), position=1.0, velocity=2.0, effort=3.0)
    message.header.frame_id = "world"
    send(message)
    graph.until(lambda: heard, "the message")
    assert heard[0] == message


def test_a_sender_with_another_clock_is_delayed_from_receipt(graph):
    graph.add(DelayInjector, REMAP, delay=0.030, delay_from="receive")
    heard = graph.listen("there")
    send = graph.talk("here")
    sent = time.time_ns()
    send(graph.joint_state(5 * 1_000_000_000, effort=1.0))  # stamped in 1970
    graph.until(lambda: heard, "the message")
    assert stamp_ns(heard[0]) >= sent + 30 * MS


def test_the_delay_can_be_set_while_running_and_order_is_kept(graph):
    graph.add(DelayInjector, REMAP, delay=0.300)
    heard = graph.listen("there")
    send = graph.talk("here")
    for k in range(10):
        send(graph.joint_state(time.time_ns(), effort=float(k)))
    graph.spin(0.02)
    assert graph.set_parameter("delay_injector", "delay", 0.0).successful
    for k in range(10, 20):
        send(graph.joint_state(time.time_ns(), effort=float(k)))
    graph.until(lambda: len(heard) == 20, "20 messages")
    assert [message.effort[0] for message in heard] == list(range(20))


@pytest.mark.parametrize("value", [-0.001, 11.0, "0.1", float("nan")])
def test_a_wrong_delay_is_refused_while_running(graph, value):
    node = graph.add(DelayInjector, REMAP, delay=0.010)
    result = graph.set_parameter("delay_injector", "delay", value)
    assert not result.successful and result.reason
    assert node.figures()["delay_ms"] == "10.000000"


def test_a_best_effort_sensor_is_heard(graph):
    graph.add(DelayInjector, REMAP, delay=0.0)
    heard = graph.listen("there")
    send = graph.talk("here", qos=qos_profile_sensor_data)
    graph.until(lambda: heard or send(graph.joint_state(time.time_ns(), position=1.0)), "a message")


def test_messages_beyond_the_queue_are_dropped_and_counted(graph):
    node = graph.add(DelayInjector, REMAP, delay=3.0, queue_size=5)
    heard = graph.listen("there")
    send = graph.talk("here")
    for k in range(8):
        send(graph.joint_state(time.time_ns(), effort=float(k)))
    graph.until(lambda: len(heard) == 5, "5 messages")
    assert node.figures()["dropped"] == "3"


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"type": "std_msgs/msg/String"}, "no header"),
        ({"type": "no_such/msg/Type"}, "not installed"),
        ({"time_mode": "lockstep", "stamp_mode": "keep"}, "the stamp is the only clock"),
        ({"profile": "missing.csv"}, "missing.csv"),
        ({"delay": -0.04}, r"\[0, 10\] s"),
        ({"delai": 0.04}, "unknown parameter delai"),
    ],
)
def test_what_cannot_work_is_refused(graph, parameters, said):
    with pytest.raises(InputError, match=said):
        graph.add(DelayInjector, REMAP, **parameters)


def test_a_profile_counts_from_the_start_of_the_run(graph, tmp_path: Path):
    table = tmp_path / "profile.csv"
    table.write_text("0.0,10.0\n1.0,0.0\n")
    node = graph.add(DelayInjector, REMAP, profile=str(table))
    heard = graph.listen("there")
    start_ns = time.time_ns() - 2_000_000_000
    graph.talk("run", String, qos=latched())(String(data=f'{{"start_ns": {start_ns}}}'))
    graph.until(lambda: node._start_ns == start_ns, "the start of the run")
    send = graph.talk("here")
    sent = time.time_ns()
    send(graph.joint_state(sent, effort=1.0))
    graph.until(lambda: heard, "the message")
    assert stamp_ns(heard[0]) - sent < 9000 * MS  # 10 s before the start, nothing two seconds after it


def test_bursts_that_overflow_the_queues_do_not_stop_it_and_what_is_lost_is_told(graph):
    """The sender keeps the last 1000 messages only: of a larger burst the middleware loses some."""
    process = graph.spawn("delay_injector", "delay_injector", REMAP)
    heard, told = graph.listen("there"), graph.listen("/diagnostics", DiagnosticArray, latched())
    send, sent, write = graph.talk("here"), 1, JointStateWriter("leg", "effort").write
    send(write(time.time_ns(), 0.0))
    graph.until(lambda: heard, "the first message, from which losses are counted")
    while sent < 40_000 and (sent < 10_000 or sent == len(heard)):
        before = len(heard)
        for _ in range(2000):
            send(write(time.time_ns(), float(sent)))
            sent += 1
        graph.until(lambda before=before: len(heard) > before, "a message of the burst")
        graph.spin(0.3)
    send(graph.joint_state(time.time_ns(), effort=float(sent)))
    graph.until(lambda: heard[-1].effort[0] == sent, "the last message")

    def figures():
        return {pair.key: int(pair.value) for pair in told[-1].status[0].values if pair.value.isdigit()}

    graph.until(lambda: told, "figures")
    graph.until(lambda: figures()["relayed"] + figures()["lost"] == sent + 1, "figures that account for all")
    assert process.returncode is None and figures()["dropped"] == 0
