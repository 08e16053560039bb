"""The twin over real topics: its own machine and one that MuJoCo moves, in silence while healthy, and with the slot after a change."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from live_machine import CHANGED, EXCITATION, LIFT, at_work
from machines_at_work import Stretch
from patience import LONG, PATIENCE
from robots.mujoco_lift import EFFECTS, Machine
from sensor_msgs.msg import JointState

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.twin.kept import save
from rhythmid.twin.settings import Settings
from rhythmid.twin.twin import Twin
from rhythmid_nodes.qos import latched, stream
from rhythmid_nodes.twin import TwinNode

HEALTHY = 25.0  # s
SIGNALS = """
time: header
input: {topic: /lift/commands, field: "effort[lift]"}
output: {topic: /lift/joint_states, field: "position[lift]"}
forcing: {topic: /lift/pump, field: wrench.force.z}
"""
pytestmark = pytest.mark.timeout(LONG)


def known(folder: Path) -> Stretch:
    """Leave a model and a calibration of the healthy lift in a folder; what it was learnt from."""
    (folder / "lift.yaml").write_text(LIFT)
    signals = at_work(Model.from_text(LIFT, catalogue=load_catalogue()), 0.0, HEALTHY + 1.5)
    twin = Twin(Model.load(folder / "lift.yaml"), Settings(healthy=HEALTHY))
    for role, time, value in signals.channels:
        twin.push(role, time, value)
    twin.advance()
    assert twin.calibration is not None
    save(twin.calibration, folder / "healthy.json")
    return signals


def test_it_tells_a_change_on_diagnostics_and_plots_its_figures(graph, tmp_path):
    learnt = known(tmp_path)
    (tmp_path / "signals.yaml").write_text(SIGNALS)
    model = Model.load(tmp_path / "lift.yaml")
    at = learnt.time[-1] + 11.0
    before = at_work(model, learnt.time[-1], at, learnt.end, seed=1)
    later = at_work(CHANGED["measurement"](model), at, at + 6.0, before.end, seed=2)
    heard = graph.listen("/diagnostics", DiagnosticArray, latched(1000))
    plotted = graph.listen("twin/state", JointState)
    profile = stream(lockstep=False)
    publishers = {
        topic: graph.probe.create_publisher(kind, topic, profile)
        for topic, kind in (
            ("/lift/commands", JointState), ("/lift/joint_states", JointState), ("/lift/pump", WrenchStamped),
        )
    }  # fmt: skip
    command, states, pump = (publisher.publish for publisher in publishers.values())
    node = graph.add(
        TwinNode, model=str(tmp_path / "lift.yaml"), signals=str(tmp_path / "signals.yaml"), diagnose=False,
        calibration=str(tmp_path / "healthy.json"), hardware_id="lift 7", result=str(tmp_path / "watch.json"),
    )  # fmt: skip
    graph.until(lambda: not node.obstacles(), "the twin's subscriptions")
    for topic, publisher in publishers.items():
        graph.until(lambda one=publisher: one.get_subscription_count() == 1, f"the twin on {topic}")
    signals = before.then(later)
    for k, (t, s) in enumerate(zip(signals.time, signals.stamp, strict=True)):
        command(stamped(JointState(name=["wheel", "lift"], effort=[0.0, signals.command[k]]), t))
        states(stamped(JointState(name=["wheel", "lift"], position=[9.0, signals.measured[k]]), s))
        wrench = stamped(WrenchStamped(), t)
        wrench.wrench.force.z = float(signals.forcing[k])
        pump(wrench)
        if k % 50 == 0:  # the middleware keeps the newest only
            graph.until(lambda sent=k + 1: all(ear.count == sent for ear in node._ears.values()), "them all")
    said = lambda: [s for m in heard for s in m.status if s.name == "rhythmid: hopper/twin/model"]  # noqa: E731
    graph.until(lambda: any(s.level != DiagnosticStatus.OK for s in said()), "a warning")
    graph.until(lambda: plotted and plotted[-1].header.stamp.sec >= int(signals.stamp[-1] - 1.0), "the end")
    assert {s.hardware_id for s in said()} == {"lift 7"}
    values = dict(zip(plotted[-1].name, plotted[-1].position, strict=True))
    assert max((name for name in values if name.startswith("share")), key=values.get) == "share sensor [1]"
    assert values["delay measurement [s]"] == pytest.approx(0.010, abs=1e-3)
    healthy = [p for p in plotted if p.header.stamp.sec < int(at)]
    assert healthy and all(p.position[0] < 1.0 for p in healthy)
    node.close()
    (event,) = json.loads((tmp_path / "watch.json").read_text())["events"]
    assert event["slot"] == "sensor"


def stamped(message, time: float):
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(round(1e9 * time), 1_000_000_000)
    return message


def test_a_machine_that_mujoco_moves_is_followed_and_its_friction_is_told():
    rate, change, end = 250.0, 40.0, 48.0
    time = np.arange(round(end * rate)) / rate
    command = EXCITATION(np.mod(time, EXCITATION.period))
    machine, position = Machine(EFFECTS | {"friction": 0.5}), np.empty(len(time))
    for k, t in enumerate(time):
        if math.isclose(t, change):
            rougher = Machine(EFFECTS | {"friction": 1.0})
            rougher._data.qpos[:], rougher._data.qvel[:] = machine._data.qpos, machine._data.qvel
            rougher._data.time = machine._data.time
            machine = rougher
        position[k] = machine.state[0][0]
        machine.advance(t + 1.0 / rate, float(command[k]))
    measured = position + 1e-4 * np.random.default_rng(0).standard_normal(len(time))
    forcing = np.array([Machine.pump(t) for t in time])
    model = Model.from_text(
        LIFT.replace("0.01, unit: s", "0.0, unit: s").replace("0.005, unit: s}", "0.0, unit: s}")
    )
    model = model.with_values({"coulomb_friction.force": 0.5})
    twin = Twin(model, Settings(healthy=HEALTHY))
    said = []
    for first in range(0, len(time), 250):
        part = slice(first, first + 250)
        for role, value in (("input", command), ("forcing", forcing), ("output", measured)):
            twin.push(role, time[part], value[part])
        said += twin.advance()
    assert all(status.since is None for status in said if status.time < change)
    assert said[-1].mismatch > 1.0 and said[-1].isolation.slot == "force"
    assert said[-1].isolation.changes[0].size == pytest.approx(0.5, rel=0.2)


def test_the_command_watches_until_it_is_interrupted(graph, tmp_path):
    (tmp_path / "lift.yaml").write_text(LIFT)
    line = [sys.executable, "-m", "rhythmid.cli", "watch", "lift.yaml", "--json", "watch.json"]
    heard = graph.listen("/diagnostics", DiagnosticArray, latched(1000))
    process = subprocess.Popen(line, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    try:
        graph.until(
            lambda: any(s.name == "rhythmid: hopper/twin" for m in heard for s in m.status), "the twin"
        )
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 0, said
    assert json.loads((tmp_path / "watch.json").read_text()) == {"events": []}
    assert "twin" in said  # the board, or that it has been waited for


def test_a_watch_that_fails_writes_no_result(graph, tmp_path, monkeypatch):
    (tmp_path / "lift.yaml").write_text(LIFT)
    node = graph.add(TwinNode, model=str(tmp_path / "lift.yaml"), result=str(tmp_path / "watch.json"))

    def refused():
        raise InputError("most measurements came too late")

    monkeypatch.setattr(node._watch, "advance", refused)
    graph.until(lambda: node.failure is not None, "the failure")
    node.close()
    assert not (tmp_path / "watch.json").exists()


def test_what_the_node_refuses_the_command_says_in_one_line(domain, rhythmid):
    done = rhythmid("watch", "absent.yaml")
    assert (
        done.returncode == 2
        and done.stderr.startswith("error:")
        and "absent.yaml: cannot be read" in done.stderr
    )


@pytest.mark.parametrize(("parameters", "said"), [
    ({}, "model is missing"),
    ({"model": "absent.yaml"}, "absent.yaml"),
    ({"time_mode": "lockstep"}, "in real time"),
    ({"healthy": 1.0}, "healthy"),
    ({"signals": "formula.yaml"}, "by formula"),
    ({"signals": "table.yaml"}, "columns of tables"),
])  # fmt: skip
def test_what_cannot_work_is_refused(graph, tmp_path, monkeypatch, parameters, said):
    monkeypatch.chdir(tmp_path)
    topic = '{topic: /x, field: "position[a]"}'
    Path("formula.yaml").write_text(f"output: {topic}\nforcing: {{amplitude: 1.0, frequency: 1.0}}\n")
    Path("table.yaml").write_text("time: {sample_rate: 100}\noutput: {file: a.csv, column: y}\n")
    with pytest.raises(InputError, match=said):
        graph.add(TwinNode, **parameters)
