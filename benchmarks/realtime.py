"""Timing of the graph, compared with a bare nanosleep loop and a plain rclpy timer that run at the same time.

    python benchmarks/realtime.py [--seconds 60] [--load 4] [--lockstep 60]

Four runs in real time, composed and in separate processes, with and without other busy processes; then lockstep in both
layouts. Times in ms. `lateness` is that of ticks against their grid; `applied delay` that of a release against stamp + delay; `latency`
goes from the release of a command until the recorder's middleware has it, by message.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import yaml
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from safety import load

from rhythmid.testing import PAPER_HOPPER
from rhythmid_bringup.processes import Supervised
from rhythmid_nodes.joint_state import stamp_of

DELAYS = {"input": 0.040, "measurement": 0.050}  # s
TICKS = ("plant", "excitation")
RELAYS = ("command_delay", "measurement_delay")
LOSSES = ("lost", "dropped", "skipped")
QUANTITIES = ("p50", "p99", "p99.9", "max")
LOOPS = ("nanosleep", "timer")
SCRIPT = Path(__file__).with_name("periodic_loops.py")
BEGUN = 50_000  # bytes of a bag with more than the first messages
LOOK = 0.5  # s between two measurements of the processor times
_TICK = os.sysconf("SC_CLK_TCK")


@dataclass
class Usage:
    """Processor time [s] of the nodes of a run, by name: (time of the look, time used)."""

    looks: dict[str, list[tuple[float, float]]] = field(default_factory=dict)

    def look(self, parent: int) -> None:
        """Note what the children of a process have used."""
        for entry in Path("/proc").iterdir():
            try:
                words = (entry / "cmdline").read_text().split("\0") if entry.name.isdecimal() else []
                numbers = (entry / "stat").read_text().rpartition(")")[2].split() if words else []
            except OSError:
                continue
            if numbers and int(numbers[1]) == parent:
                names = [word.removeprefix("__node:=") for word in words if word.startswith("__node:=")]
                names += ["graph"] * ("rhythmid_nodes.compose" in words)
                used = (int(numbers[11]) + int(numbers[12])) / _TICK
                for name in names:
                    self.looks.setdefault(name, []).append((time.monotonic(), used))

    def percent(self, seconds: float) -> dict[str, float]:
        """Share of a core [%] in the last `seconds`, by node."""
        found = {}
        for name, looks in self.looks.items():
            late = [look for look in looks if look[0] >= looks[-1][0] - seconds]
            if len(late) > 1:
                found[name] = 100.0 * (late[-1][1] - late[0][1]) / (late[-1][0] - late[0][0])
        return found


def experiment(folder: Path, mode: str, layout: str, seconds: float) -> Path:
    """A chirp on the paper's hopper; in real time everything is recorded, diagnostics too."""
    everything = ["excitation", "command", "forcing", "plant/joint_states", "joint_states", "run"]
    content = {
        "model": str(PAPER_HOPPER),
        "excitation": {"type": "chirp", "amplitude": 0.004, "band": [0, 7], "sweep": seconds},
        "delays": DELAYS,
        "time": {"mode": mode, "layout": layout},
        # a busy computer is part of the measurement, and must not end the run
        "safety": {"stale_after": 10.0, "command_timeout": 0.0},
        "record": {"topics": [*everything, "diagnostics"] if mode == "realtime" else everything},
    }
    path = folder / f"{mode}_{layout}.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def run(path: Path, bag: Path, usage: Usage, begun: Callable[[], None] = lambda: None) -> tuple[float, float]:
    """Run an experiment; seconds played and seconds taken for it. `begun` is called when something has been recorded."""
    told = False
    with tempfile.TemporaryFile("w+") as said:
        words = [sys.executable, "-m", "rhythmid.cli", "run", str(path), "--out", str(bag)]
        process = subprocess.Popen(words, stdout=said, stderr=said)
        while process.poll() is None:
            usage.look(process.pid)
            if not told and any(file.stat().st_size > BEGUN for file in bag.glob("*.mcap")):
                told = True
                begun()
            time.sleep(LOOK)
        said.seek(0)
        text = said.read()
    found = re.search(r"([\d.]+) s played in ([\d.]+) s", text)
    if found is None or process.returncode != 0:
        raise SystemExit(f"the run ended with exit code {process.returncode}:\n{text}")
    return float(found[1]), float(found[2])


def reading(bag: Path) -> tuple[dict[str, dict[str, str]], dict[str, np.ndarray]]:
    """The last figures of every node, and by topic the stamps and receive times [ns] of its messages, int64[n, 2]."""
    types = get_typestore(Stores.ROS2_JAZZY)
    figures: dict[str, dict[str, str]] = {}
    times: dict[str, list[tuple[int, int]]] = {}
    with Reader(bag) as reader:
        for connection, received_ns, data in reader.messages():
            topic = connection.topic.removeprefix("/hopper/")
            if topic == "/diagnostics":
                message: Any = types.deserialize_cdr(data, connection.msgtype)
                for status in message.status:
                    figures[status.name.rpartition("/")[2]] = {pair.key: pair.value for pair in status.values}
            elif topic != "run":
                times.setdefault(topic, []).append((stamp_of(bytes(data)), received_ns))
    return figures, {topic: np.array(pairs) for topic, pairs in times.items()}


def row(name: str, told: dict[str, str], prefix: str) -> None:
    """One line of a table from the figures of a node."""
    values = [f"{float(told[f'{prefix}_{quantity}_ms']):9.3f}" for quantity in QUANTITIES]
    rate = f"{float(told['rate_hz']):9.2f}" if "rate_hz" in told else " " * 9
    print(f"  {name:34}{rate}{''.join(values)}", flush=True)


def realtime(folder: Path, layout: str, busy: int, seconds: float) -> None:
    """One run in real time with the loops in parallel."""
    print(f"{layout}, {busy} busy processes beside, {os.getloadavg()[0]:.1f} ready to run at the start")
    print(f"  {'':34}{'rate Hz':>9}{''.join(f'{quantity:>9}' for quantity in QUANTITIES)}")
    bag, usage = folder / f"bag_{layout}_{busy}", Usage()
    loops: list[Supervised] = []
    said: dict[str, str] = {}

    def begin() -> None:
        for name in LOOPS:
            words = [sys.executable, str(SCRIPT), name, "1000", str(seconds)]
            loops.append(Supervised(name, words, os.environ, said.__setitem__))
            loops[-1].hurry()  # as the nodes of a run are

    with load(busy):
        run(experiment(folder, "realtime", layout, seconds), bag, usage, begin)
        while any(process.returncode is None for process in loops):
            time.sleep(LOOK)
    for process in loops:
        process.join_output()
    told = {name: json.loads(line) for name, line in said.items()}
    figures, times = reading(bag)
    for name in LOOPS:
        row(f"{name} loop, lateness", told[name], "lateness")
    for name in TICKS:
        row(f"{name}, lateness", figures[name], "lateness")
    for name in RELAYS:
        row(f"{name}, applied delay", figures[name], "delay_error")
    stamps = times["command"]
    latency = (stamps[:, 1] - stamps[:, 0]) * 1e-6
    values = [*np.percentile(latency, (50.0, 99.0, 99.9)), latency.max()]
    print(f"  {'latency':34}{'':9}{''.join(f'{value:9.3f}' for value in values)}")
    lost = {f"{name} {key}": figures[name][key] for name in figures for key in LOSSES if key in figures[name]}
    print(f"  losses: {', '.join(f'{key} {value}' for key, value in lost.items() if value != '0') or 'none'}")
    recorded = ", ".join(f"{topic} {len(rows)}" for topic, rows in times.items())
    print(f"  recorded: {recorded}")
    loop = {name: float(values["cpu_percent"]) for name, values in told.items()}
    shares = {**usage.percent(seconds), **loop}
    print(
        f"  share of a core [%]: {', '.join(f'{name} {share:.0f}' for name, share in shares.items())}\n",
        flush=True,
    )


def main(
    seconds: Annotated[float, typer.Option(help="length of each run in real time")] = 60.0,
    busy: Annotated[int, typer.Option("--load", help="busy processes in the loaded runs")] = 4,
    lockstep: Annotated[float, typer.Option(help="simulated seconds of each lockstep run; 0: none")] = 60.0,
    layout: Annotated[list[str] | None, typer.Option(help="composed, processes; none: both")] = None,
) -> None:
    layouts = layout or ["composed", "processes"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if seconds > 0.0:
            for beside in sorted({0, busy}):
                for one in layouts:
                    realtime(folder, one, beside, seconds)
        if lockstep > 0.0:
            for one in layouts:
                path = experiment(folder, "lockstep", one, lockstep)
                played, taken = run(path, folder / f"lockstep_{one}", Usage())
                print(
                    f"lockstep, {one}: {played / taken:.1f} x real time ({os.getloadavg()[0]:.1f} ready to run)",
                    flush=True,
                )


if __name__ == "__main__":
    typer.run(main)
