"""Time from a fault to zero effort at a robot, over real topics and processes; and stops without a fault.

    python benchmarks/safety.py [--count 100] [--fault NAME ...] [--limits robot|strict|nodes] [--load 2]
    python benchmarks/safety.py --healthy 1800 [--limits robot|strict|nodes] [--load 2]

This process is the robot: it measures at 200 Hz and receives its commands. `excitation` and `command_guard` are separate
processes. The time of a fault counts from its injection to the first zero command of the guard that lasts. `--limits` sets the timeouts of
the nodes: `robot`, those of docs/robot.md, with which every fault leads to zero effort within 0.1 s; `strict`, 0.05 s each; `nodes`, the nodes' defaults,
which are for simulated plants. `--load` adds busy processes. The session of this process gets a higher priority if the user has the right to set it,
because a robot is not slowed by the computer's other programs; the nodes' sessions do not.
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated

import rclpy
import typer
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from safety_bench import EFFORT, Bench, Limits, wait
from sensor_msgs.msg import JointState

from rhythmid_bringup.environment import own_domain, run_environment
from rhythmid_nodes.joint_state import JointStateWriter
from rhythmid_nodes.qos import stream

PROMISED = 0.1  # seconds to zero effort
DEFAULT_LIMIT = 0.5  # seconds: the nodes' default of stale_after
SETTLED = 0.25  # seconds for which zero has to last


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
    """One gap in the stamps: they are first behind, then ahead, each by less than the limit for stale measurements."""
    limit = bench.limits.stale or DEFAULT_LIMIT
    offset = -int(0.7 * limit * 1e9)
    bench.robot.spoil = lambda stamp, position: (stamp + offset, position)
    time.sleep(2 * limit)
    step = int(1.4 * limit * 1e9)
    bench.robot.spoil = lambda stamp, position: (stamp + offset + step, position)
    return bench.robot.measure_well


def killed(bench: Bench) -> Callable[[], None]:
    os.kill(bench.pid("excitation"), signal.SIGKILL)
    return lambda: bench.stop("command_guard")  # the middleware needs 20 s to detect a killed publisher


def paused(bench: Bench) -> Callable[[], None]:
    os.kill(bench.pid("excitation"), signal.SIGSTOP)
    return lambda: os.kill(bench.pid("excitation"), signal.SIGCONT)


def stranger(bench: Bench) -> Callable[[], None]:
    """Another node publishes ten times the effort of the excitation."""
    node = Node("stranger", namespace="/hopper")
    publisher = node.create_publisher(JointState, "command", stream(lockstep=False))
    wait(lambda: publisher.get_subscription_count() > 0, "a listener")
    publisher.publish(JointStateWriter("leg", "effort").write(time.time_ns(), 10.0 * EFFORT))

    def leave() -> None:
        wait(lambda: bench.ended("command_guard"), "end of the guard")
        node.destroy_node()

    return leave


def leaving(bench: Bench) -> Callable[[], None]:
    """The only subscriber of the excitation ends regularly; measured is the time until the excitation stops."""
    bench.robot.stops.clear()
    bench.stop("command_guard")
    return lambda: None


LEAVING = "guard_leaves"
PREPARED = ("gap", "second_commander", LEAVING)  # faults that begin after their preparation
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
    if not after:  # no further message, and the last one was zero
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
    """This number of busy processes, each in a session of its own, as programs of other terminals are."""
    line = [sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(line, start_new_session=True) for _ in range(number)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


@contextmanager
def benched(limits: Limits, priority: int, tell: bool) -> Iterator[Bench]:
    """A bench in its own DDS domain, with these timeouts and this priority of the nodes; with `tell` it prints the output of the nodes."""
    with tempfile.TemporaryDirectory() as folder, own_domain() as domain:
        os.environ.pop("ROS_DOMAIN_ID", None)
        os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = (
            "UDPv4"  # killed processes would leave shared memory behind
        )
        os.environ.update(run_environment(os.environ, domain, Path(folder)))
        with suppress(OSError):
            Path("/proc/self/autogroup").write_text("-10", encoding="ascii")
        rclpy.init(args=[])
        bench = Bench(Path(folder), limits.times, priority, tell)
        try:
            yield bench
        finally:
            bench.end()
            try_shutdown()


def stay_healthy(bench: Bench, seconds: float) -> bool:
    """Whether the excitation continues for this time; lapses of the command, after which effort returns, are reported."""
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
    priority: Annotated[int, typer.Option(help="of the nodes (SCHED_FIFO); 0: none")] = 0,
) -> None:
    kept = True
    with load(busy), benched(limits, priority, tell=bool(healthy)) as bench:
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
