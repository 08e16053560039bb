"""Kills the recorder (SIGKILL) at random moments, and measures what can be read afterwards and how much is lost.

python benchmarks/kill_recorder.py [TIMES [SEED]]

A sender publishes numbered messages at 1 kHz all the time. The recovered bag must contain consecutive numbers
without a gap, with exactly the bytes that were sent.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from sensor_msgs.msg import JointState

from rhythmid.errors import InputError
from rhythmid.record.bag import Bag
from rhythmid.record.recover import recover
from rhythmid_bringup.environment import own_domain, run_environment
from rhythmid_nodes.joint_state import JointStateWriter
from rhythmid_nodes.qos import stream

PERIOD = 1e-3  # seconds
LONGEST = 4.0  # seconds after the first message at which the recorder is killed at the latest
ALLOWED = 1.5  # seconds


@dataclass(frozen=True)
class Loss:
    """The result of a killed recorder: seconds lost at the end, messages kept, whether they equal the sent ones."""

    seconds: float
    kept: int
    identical: bool


class Sender(Node):
    """Publishes numbered messages at 1 kHz as soon as there is a subscriber."""

    def __init__(self, context: Context) -> None:
        super().__init__("sender", context=context)
        self.sent: list[tuple[float, bytes]] = []  # when, and what
        self._publisher = self.create_publisher(JointState, "joint_states", stream(lockstep=False))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._send)

    def start(self, patience: float = 120.0) -> None:
        """Wait for the recorder, and begin."""
        until = time.monotonic() + patience
        while self._publisher.get_subscription_count() == 0:
            if time.monotonic() > until:
                raise RuntimeError("the recorder did not come")
            time.sleep(0.02)
        self._thread.start()

    def end(self) -> None:
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def _send(self) -> None:
        write = JointStateWriter("leg", "effort").write
        due = time.monotonic()
        while not self._ended.is_set():
            data = write(time.time_ns(), float(len(self.sent)))
            self.sent.append((time.monotonic(), data))
            self._publisher.publish(data)
            due += PERIOD
            time.sleep(max(0.0, due - time.monotonic()))


def kill(folder: Path, storage: str, after: float) -> Loss:
    """Kill a recorder `after` so many seconds of recording, and recover its bag, all in `folder`."""
    bag = folder / "killed"
    command = [sys.executable, "-m", "rhythmid_nodes.recorder", "--ros-args", "-p", f"path:={bag}"]
    process = subprocess.Popen([*command, "-p", f"storage:={storage}", "-p", "topics:=[joint_states]"])
    context = Context()
    rclpy.init(args=[], context=context)
    sender = Sender(context)
    try:
        sender.start()
        time.sleep(after)
        process.send_signal(signal.SIGKILL)
        killed_at = time.monotonic()
    finally:
        process.kill()
        process.wait()
        sender.end()
        sender.destroy_node()
        rclpy.shutdown(context=context)
    return loss_of(bag, [row for row in sender.sent if row[0] < killed_at], killed_at, folder / "recovered")


def loss_of(bag: Path, sent: list[tuple[float, bytes]], killed_at: float, out: Path) -> Loss:
    """Compare a killed recorder's bag with what was sent before."""
    try:
        recover(bag, out)
    except InputError as nothing:
        if "holds no readable message" not in str(nothing):
            raise
        return Loss(killed_at - sent[0][0], 0, True)
    kept = [data for block in Bag(out).blocks() for data in block]
    numbers = {data: number for number, (_, data) in enumerate(sent)}
    places = [numbers.get(data, -1) for data in kept]
    identical = -1 not in places and places == list(range(places[0], places[0] + len(places)))
    return Loss(killed_at - sent[max(places)][0], len(kept), identical)


def main() -> None:
    times, seed = (int(given) for given in (*sys.argv[1:], *("200", "0")[len(sys.argv) - 1 :]))
    draw = random.Random(seed)
    os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = (
        "UDPv4"  # a killed process would leave its shared memory behind
    )
    with own_domain() as domain, tempfile.TemporaryDirectory() as log:
        os.environ.update(run_environment(os.environ, domain, Path(log)))
        for storage in ("mcap", "sqlite3"):
            losses = []
            for _ in range(times // 2):
                with tempfile.TemporaryDirectory() as folder:
                    losses.append(kill(Path(folder), storage, draw.uniform(0.0, LONGEST)))
            good = sum(loss.identical and loss.seconds <= ALLOWED for loss in losses)
            print(
                f"{storage}: {good} of {len(losses)} readable, the rest identical, at most {ALLOWED} s lost; "
                f"lost {max(loss.seconds for loss in losses):.2f} s at most, "
                f"{sum(loss.seconds for loss in losses) / len(losses):.2f} s on average",
                flush=True,
            )


if __name__ == "__main__":
    main()
