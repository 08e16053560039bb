"""The robot and its nodes in the safety benchmark: a plant that measures and receives commands, and its supervision."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import yaml
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from rhythmid_bringup.processes import Supervised, end
from rhythmid_nodes.clock import Clock, Grid, Worker
from rhythmid_nodes.joint_state import JointStateReader, JointStateWriter
from rhythmid_nodes.qos import latched, stream, subscribe_informed

EFFORT = 0.5  # N
FRESH = 0.05  # seconds since the newest command while effort flows
EXCITATION = {
    "excitation": json.dumps({"type": "profile", "points": [[0.0, EFFORT]], "length": 7200.0}),
    "max_effort": 1.0, "envelope": [0.0, 0.4], "max_speed": 3.0, "subscribers": 1,
}  # fmt: skip
GUARD = {"max_effort": 1.0, "stale_after": 0.0}


@dataclass(frozen=True)
class Times:
    """Timeouts of the nodes [s]: `stale` for a newer measurement (by arrival, by stamp, and from stamp to stamp), `frozen`
    for another position, `command` for a newer command. None: the nodes' defaults."""

    stale: float | None = None
    frozen: float | None = None
    command: float | None = None

    def parameters(self, node: str) -> dict[str, float]:
        """Those of a node."""
        given = (
            {"stale_after": self.stale, "frozen_after": self.frozen}
            if node == "excitation"
            else {"command_timeout": self.command}
        )
        return {name: value for name, value in given.items() if value is not None}


class Limits(StrEnum):
    """By their names."""

    ROBOT = "robot"
    STRICT = "strict"
    NODES = "nodes"

    @property
    def times(self) -> Times:
        known = {Limits.ROBOT: Times(0.08, 0.06, 0.06), Limits.STRICT: Times(0.05, 0.05, 0.05)}
        return known.get(self, Times())


class Robot:
    """Measures at 200 Hz, as `spoil` distorts it, and keeps when which effort was published to it [s since the epoch, N]."""

    def __init__(self) -> None:
        self.node = Node("robot", namespace="/hopper")
        self.heard: list[tuple[float, float]] = []
        self.stops: list[float] = []  # time at which the excitation reported its stop [s since the epoch]
        self.spoil: Callable[[int, float], tuple[int, float] | None] = lambda stamp, position: (
            stamp,
            position,
        )
        self._writer, self._reader = JointStateWriter("leg", "position"), JointStateReader("leg")
        self._states = self.node.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
        self.listen()
        sys.setswitchinterval(2e-4)  # as in the nodes
        self._grid = Grid(Clock(), 5_000_000, self._measure)
        self._executor = EventsExecutor()
        self._executor.add_node(self.node)
        self._server = Worker("executor", self._serve)
        for worker in (self._grid, self._server):
            worker.start()

    def listen(self) -> None:
        profile = stream(lockstep=False)
        subscribe_informed(self.node, JointState, "robot/command", self._hear, profile)
        subscribe_informed(self.node, String, "run", self._hear_of_run, latched())

    def measure_well(self) -> None:
        self.spoil = lambda stamp, position: (stamp, position)

    def effort(self) -> float:
        return self.heard[-1][1] if self.heard else 0.0

    def call(self, service: str) -> None:
        """Call a service and wait a moment for the answer, because a killed node seems to exist for some time."""
        client = self.node.create_client(Trigger, service)
        wait(client.service_is_ready, service)
        future = client.call_async(Trigger.Request())
        patience = time.monotonic() + 0.5
        while not future.done() and time.monotonic() < patience:
            time.sleep(0.005)
        self.node.destroy_client(client)

    def figures(self) -> dict[str, str]:
        """Lateness of this process's measurements, caused by the bench itself."""
        return self._grid.figures()

    def close(self) -> None:
        for worker in (self._grid, self._server):
            worker.stop()
        self._executor.shutdown()
        self.node.destroy_node()

    def _measure(self, stamp_ns: int) -> None:
        measured = self.spoil(stamp_ns, 0.15 + 0.02 * math.sin(stamp_ns * 1e-9 % 1000.0 * 6.0))
        if measured is not None:
            self._states.publish(self._writer.write(*measured))

    def _hear(self, data: bytes, about: dict[str, Any]) -> None:
        sample = self._reader.read(data)
        if sample is not None:
            self.heard.append((about["source_timestamp"] * 1e-9, sample.effort))

    def _hear_of_run(self, data: bytes, about: dict[str, Any]) -> None:
        if b'"state": "stopped"' in data:
            self.stops.append(about["source_timestamp"] * 1e-9)

    def _serve(self) -> None:
        while not self._server.stopping.is_set():
            self._executor.spin_once(timeout_sec=0.05)


class Bench:
    """The two nodes under test, restarted if a fault has ended one."""

    def __init__(self, folder: Path, limits: Times, priority: int, tell: bool) -> None:
        self.limits = limits
        self._priority = priority
        self._tell = tell
        self.robot = Robot()
        self.stops = 0
        self._folder = folder
        self._running: dict[str, Supervised] = {}

    def _said(self, name: str, line: str) -> None:
        if self._tell:
            print(f"{name}: {line}", flush=True)

    def ended(self, name: str) -> bool:
        return self._running[name].returncode is not None

    def pid(self, name: str) -> int:
        return self._running[name]._process.pid

    def playing(self) -> None:
        """Everything is healthy, and effort is applied."""
        self.robot.measure_well()
        while True:
            wait(self._flows, "effort", 300.0)
            time.sleep(0.05)
            if self.robot.effort() == EFFORT and time.time() - self.robot.heard[-1][0] < FRESH:
                return
            self.stops += 1  # without a fault

    def _flows(self) -> bool:
        self._keep("command_guard", GUARD, {"joint_states": "unmeasured"})
        self._keep("excitation", EXCITATION, {"excitation": "command"})
        if self.robot.effort() == EFFORT:
            return True
        self.robot.call("excitation/start")
        time.sleep(0.02)
        return False

    def stop(self, name: str) -> None:
        """End a node regularly."""
        os.kill(self.pid(name), signal.SIGINT)
        wait(lambda: self.ended(name), f"end of {name}")

    def end(self) -> None:
        end(list(self._running.values()))
        self.robot.close()

    def _keep(self, name: str, parameters: dict[str, Any], remap: dict[str, str]) -> None:
        if name in self._running and not self.ended(name):
            return
        path = self._folder / f"{name}.yaml"
        given = {**parameters, "priority": self._priority, **self.limits.parameters(name)}
        path.write_text(yaml.safe_dump({"/**": {"ros__parameters": given}}, width=2**16))
        line = [
            sys.executable,
            "-P",
            "-m",
            f"rhythmid_nodes.{name}",
            "--ros-args",
            "--params-file",
            str(path),
        ]
        for source, target in {"__ns": "/hopper", **remap}.items():
            line += ["-r", f"{source}:={target}"]
        self._running[name] = Supervised(name, line, os.environ, self._said)


def wait(condition: Callable[[], Any], what: str, timeout: float = 60.0) -> None:
    patience = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > patience:
            raise SystemExit(f"no {what} within {timeout:g} s")
        time.sleep(0.002)
