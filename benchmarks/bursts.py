"""Repeated bursts through the delay injector, as many messages as can be published at once. No burst may stop it.

python benchmarks/bursts.py [BURSTS [MESSAGES]]
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState

from rhythmid_bringup.environment import own_domain, run_environment
from rhythmid_nodes.joint_state import JointStateWriter
from rhythmid_nodes.qos import stream

QUIET = 0.5  # seconds without a message after which a burst is over
PATIENCE = 10.0  # seconds in which the first message of a burst must come through
INJECTOR = [sys.executable, "-m", "rhythmid_nodes.delay_injector", "--ros-args", "-r", "input:=here", "-r", "output:=there"]  # fmt: skip


class Bursts(Node):
    """Publishes bursts on one side of the injector and counts what comes out on the other."""

    def __init__(self) -> None:
        super().__init__("bursts")
        self.heard, self.heard_at = 0, 0.0
        self._executor = EventsExecutor()
        self._executor.add_node(self)
        self._write = JointStateWriter("leg", "effort").write
        self._publisher = self.create_publisher(JointState, "here", stream(lockstep=False))
        self.create_subscription(JointState, "there", self._on_message, stream(lockstep=False), raw=True)
        while self._publisher.get_subscription_count() == 0:
            self._executor.spin_once(timeout_sec=0.05)

    def burst(self, messages: int) -> int:
        """Publish a burst; returns the number of messages that came through."""
        before, begun = self.heard, time.monotonic()
        for number in range(messages):
            self._publisher.publish(self._write(time.time_ns(), float(number)))
        self.heard_at = time.monotonic()
        while self.heard - before < messages:
            now = time.monotonic()
            if now - self.heard_at > QUIET and (self.heard > before or now - begun > PATIENCE):
                break
            self._executor.spin_once(timeout_sec=0.05)
        return self.heard - before

    def _on_message(self, _data: bytes) -> None:
        self.heard += 1
        self.heard_at = time.monotonic()


def main() -> None:
    bursts, messages = (int(given) for given in (*sys.argv[1:], *("200", "2000")[len(sys.argv) - 1 :]))
    with own_domain() as domain, tempfile.TemporaryDirectory() as folder:
        os.environ.update(run_environment(os.environ, domain, Path(folder)))
        injector = subprocess.Popen(INJECTOR)
        rclpy.init(args=[])
        try:
            node = Bursts()
            passed = [node.burst(messages) for _ in range(bursts)]
        finally:
            injector.send_signal(signal.SIGINT)
            injector.wait()
            try_shutdown()
    stopped = sum(count == 0 for count in passed)
    print(
        f"{bursts} bursts of {messages}: {stopped} of which nothing came through; of the others "
        f"{min(passed)} to {max(passed)} messages, {100 * sum(passed) / (bursts * messages):.1f} % in all"
    )
    sys.exit(stopped > 0)


if __name__ == "__main__":
    main()
