"""How soon the effort at a robot is zero after a fault, over real topics and processes; and whether it stops without one.

    python benchmarks/safety.py [--count 100] [--fault NAME ...] [--limits robot|strict|nodes] [--load 2]
    python benchmarks/safety.py --healthy 1800 [--limits robot|strict|nodes] [--load 2]

This process is the robot: it measures at 200 Hz and hears its commands. `excitation` and `command_guard` are processes
of their own. A fault's time counts from its injection to when the guard published the first zero of those that last. `--limits` says how long
the nodes wait: `robot`, those of docs/robot.md, with which every fault leads to zero effort within 0.1 s; `strict`, 0.05 s each; `nodes`, the nodes' defaults,
which are those of simulated plants. `--load` adds busy processes.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import rclpy
import typer
import yaml
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from rhythmid_bringup.environment import own_domain, run_environment
from rhythmid_bringup.processes import Supervised, end
from rhythmid_nodes.clock import Clock, Grid, Worker
from rhythmid_nodes.joint_state import JointStateReader, JointStateWriter
from rhythmid_nodes.qos import latched, stream, subscribe_informed

PROMISED = 0.1  # seconds to zero effort
DEFAULT_LIMIT = 0.5  # seconds: the nodes' default of stale_after
EFFORT = 0.5  # N
SETTLED = 0.25  # seconds for which zero has to last
FRESH = 0.05  # seconds since the newest command while effort flows
EXCITATION = {
    "excitation": json.dumps({"type": "profile", "points": [[0.0, EFFORT]], "length": 7200.0}),
    "max_effort": 1.0, "envelope": [0.0, 0.4], "max_speed": 3.0, "subscribers": 1,
}  # fmt: skip
GUARD = {"max_effort": 1.0, "stale_after": 0.0}


@dataclass(frozen=True)
class Times:
    """How long the nodes wait [s]: `stale` for a newer measurement (by arrival, by stamp, and from stamp to stamp), `frozen`
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
        self.stops: list[float] = []  # when the excitation said that it had stopped [s since the epoch]
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
        """Call a service and wait a moment for the answer: one that was killed seems to be there for a while."""
        client = self.node.create_client(Trigger, service)
        wait(client.service_is_ready, service)
        future = client.call_async(Trigger.Request())
        patience = time.monotonic() + 0.5
        while not future.done() and time.monotonic() < patience:
            time.sleep(0.005)
        self.node.destroy_client(client)

    def figures(self) -> dict[str, str]:
        """How late this process measures, which is the bench's fault."""
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
    """The two nodes under test, restarted where a fault has ended one."""

    def __init__(self, folder: Path, limits: Times, tell: bool) -> None:
        self.limits = limits
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
        """Everything is healthy, and effort flows."""
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
        """End a node in good order."""
        os.kill(self.pid(name), signal.SIGINT)
        wait(lambda: self.ended(name), f"end of {name}")

    def end(self) -> None:
        end(list(self._running.values()))
        self.robot.close()

    def _keep(self, name: str, parameters: dict[str, Any], remap: dict[str, str]) -> None:
        if name in self._running and not self.ended(name):
            return
        path = self._folder / f"{name}.yaml"
        given = {**parameters, **self.limits.parameters(name)}
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


def spoilt(spoil: Callable[[int, float], tuple[int, float] | None]) -> Callable[[Bench], Callable[[], None]]:
    """A fault of the measurements, which ends with them."""

    def inject(bench: Bench) -> Callable[[], None]:
        bench.robot.spoil = spoil
        return bench.robot.measure_well

    return inject


def freeze(bench: Bench) -> Callable[[], None]:
    """The position stays where it is."""
    kept: list[float] = []

    def spoil(stamp_ns: int, position: float) -> tuple[int, float]:
        kept.append(position)
        return stamp_ns, kept[0]

    return spoilt(spoil)(bench)


def jump(bench: Bench) -> Callable[[], None]:
    """One gap in the stamps: they are behind by less than is stale, then ahead by less than that."""
    limit = bench.limits.stale or DEFAULT_LIMIT
    offset = -int(0.7 * limit * 1e9)
    bench.robot.spoil = lambda stamp, position: (stamp + offset, position)
    time.sleep(2 * limit)
    step = int(1.4 * limit * 1e9)
    bench.robot.spoil = lambda stamp, position: (stamp + offset + step, position)
    return bench.robot.measure_well


def killed(bench: Bench) -> Callable[[], None]:
    os.kill(bench.pid("excitation"), signal.SIGKILL)
    return lambda: bench.stop("command_guard")  # the middleware needs 20 s to see that a publisher was killed


def paused(bench: Bench) -> Callable[[], None]:
    os.kill(bench.pid("excitation"), signal.SIGSTOP)
    return lambda: os.kill(bench.pid("excitation"), signal.SIGCONT)


def stranger(bench: Bench) -> Callable[[], None]:
    """Another node publishes ten times the effort beside the excitation."""
    node = Node("stranger", namespace="/hopper")
    publisher = node.create_publisher(JointState, "command", stream(lockstep=False))
    wait(lambda: publisher.get_subscription_count() > 0, "a listener")
    publisher.publish(JointStateWriter("leg", "effort").write(time.time_ns(), 10.0 * EFFORT))

    def leave() -> None:
        wait(lambda: bench.ended("command_guard"), "end of the guard")
        node.destroy_node()

    return leave


def leaving(bench: Bench) -> Callable[[], None]:
    """The only one who hears the excitation ends in good order; what is timed is when the excitation stops after that."""
    bench.robot.stops.clear()
    bench.stop("command_guard")
    return lambda: None


LEAVING = "guard_leaves"
PREPARED = ("gap", "second_commander", LEAVING)  # faults that begin when their preparation has ended
FAULTS: dict[str, Callable[[Bench], Callable[[], None]]] = {
    "stale_arrival": spoilt(lambda *_: None),
    "stale_stamp": spoilt(lambda stamp, position: (stamp - 1_000_000_000, position)),
    "gap": jump,
    "frozen": freeze,
    "nan": spoilt(lambda stamp, _: (stamp, math.nan)),
    "envelope": spoilt(lambda stamp, _: (stamp, 0.5)),
    "speed": spoilt(lambda stamp, _: (stamp, 0.15 + 0.1 * (stamp // 5_000_000 % 2))),
    "killed_excitation": killed,
    "paused_excitation": paused,
    "second_commander": stranger,
    LEAVING: leaving,
}


def trial(bench: Bench, fault: str) -> float:
    """Seconds from a fault to zero effort that lasts; infinite if there is none."""
    bench.playing()
    heard = bench.robot.heard
    begin = time.time()
    mend = FAULTS[fault](bench)
    if fault in PREPARED:
        begin = time.time()
    time.sleep(PROMISED + SETTLED)
    after = [(at, effort) for at, effort in list(heard) if at >= begin]
    last = max((number for number, (_, effort) in enumerate(after) if effort != 0.0), default=-1)
    zero = after[last + 1][0] - begin if last + 1 < len(after) else math.inf
    if not after:  # nothing came any more, and the last was zero before
        zero = 0.0 if bench.robot.effort() == 0.0 else math.inf
    if any(abs(effort) > 1.0 for _, effort in after):
        zero = math.inf
    if fault == LEAVING:
        zero = max(zero, min(bench.robot.stops, default=math.inf) - begin)
    mend()
    time.sleep(0.05)
    heard.clear()
    return zero


@contextmanager
def load(number: int) -> Iterator[None]:
    """So many busy processes."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(number)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


@contextmanager
def benched(limits: Limits, tell: bool) -> Iterator[Bench]:
    """A bench in a DDS domain of its own, with these limits of time; with `tell` it prints what the nodes say."""
    with tempfile.TemporaryDirectory() as folder, own_domain() as domain:
        os.environ.pop("ROS_DOMAIN_ID", None)
        os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = (
            "UDPv4"  # killed processes would leave shared memory behind
        )
        os.environ.update(run_environment(os.environ, domain, Path(folder)))
        rclpy.init(args=[])
        bench = Bench(Path(folder), limits.times, tell)
        try:
            yield bench
        finally:
            bench.end()
            try_shutdown()


def stay_healthy(bench: Bench, seconds: float) -> bool:
    """Whether the excitation plays on for so long; lapses of the command, from which effort comes back, are told."""
    bench.playing()
    bench.robot.heard.clear()
    until = time.monotonic() + seconds
    lapses = 0
    while time.monotonic() < until:
        time.sleep(1.0)
        heard, bench.robot.heard = bench.robot.heard, []
        lapses += any(effort != EFFORT for _, effort in heard)
        if not heard or (heard[-1][1] == 0.0 and heard[0][1] == 0.0):
            late = bench.robot.figures()["lateness_max_ms"]
            print(
                f"stopped after {seconds - until + time.monotonic():.1f} s; the robot itself was up to {late} ms late"
            )
            return False
    print(f"no stop in {seconds:g} s; {lapses} seconds with a lapse of the command")
    return True


def main(
    count: int = 10,
    limits: Annotated[Limits, typer.Option(help="how long the nodes wait")] = Limits.ROBOT,
    fault: Annotated[list[str] | None, typer.Option(help="which faults; none: all")] = None,
    busy: Annotated[int, typer.Option("--load", help="busy processes beside")] = 0,
    healthy: Annotated[float, typer.Option(help="seconds without any fault, instead")] = 0.0,
) -> None:
    kept = True
    with load(busy), benched(limits, tell=bool(healthy)) as bench:
        if healthy:
            raise typer.Exit(0 if stay_healthy(bench, healthy) else 1)
        print(f"{'fault':20} {'n':>4} {f'in {PROMISED:g} s':>9} {'median':>8} {'worst':>8}")
        for name in fault or FAULTS:
            times = sorted(trial(bench, name) for _ in range(count))
            within = sum(seconds <= PROMISED for seconds in times)
            kept &= within == count
            median, worst = times[count // 2], times[-1]
            kept &= bench.stops == 0
            print(f"{name:20} {count:4} {within:9} {median:8.4f} {worst:8.4f}", flush=True)
        print(f"{bench.stops} stops without a fault")
    raise typer.Exit(0 if kept else 1)


if __name__ == "__main__":
    typer.run(main)
