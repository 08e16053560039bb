"""What this computer achieves without rhythmid: a bare nanosleep loop, and a plain rclpy timer that publishes.

    python benchmarks/periodic_loops.py nanosleep|timer RATE SECONDS

prints as JSON the ticks per second [Hz], their lateness against a fixed grid [ms], and the share of a core [%].
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

from rhythmid_nodes.clock import Clock
from rhythmid_nodes.lateness import Lateness


class Grid:
    """Records the lateness of each tick; a tick that is more than a period late replaces all missed ticks."""

    def __init__(self, period_ns: int) -> None:
        self.lateness = Lateness(period_ns)
        self.period_ns = period_ns
        self.due_ns = self.first_ns = time.monotonic_ns() + 10 * period_ns

    def tick(self) -> None:
        late_ns = time.monotonic_ns() - self.due_ns
        self.lateness.add(max(0, late_ns))
        self.due_ns += self.period_ns * max(1, 1 + late_ns // self.period_ns)

    def figures(self) -> dict[str, str]:
        elapsed = (time.monotonic_ns() - self.first_ns) * 1e-9
        return {
            "rate_hz": f"{self.lateness.count / elapsed:.3f}",
            "cpu_percent": f"{100.0 * time.process_time() / elapsed:.1f}",
            **self.lateness.summary("lateness"),
        }


def nanosleep(period_ns: int, seconds: float) -> Grid:
    """clock_nanosleep in a loop, and nothing else."""
    clock = Clock()
    offset = clock.now() - time.monotonic_ns()
    grid = Grid(period_ns)
    end_ns = grid.first_ns + round(seconds * 1e9)
    while grid.due_ns < end_ns:
        clock.sleep_until(grid.due_ns + offset)
        grid.tick()
    return grid


def timer(period_ns: int, seconds: float) -> Grid:
    """A node as in the tutorials: a timer whose callback publishes."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from rclpy.utilities import try_shutdown
    from sensor_msgs.msg import JointState

    rclpy.init(args=[])
    node = Node("timer")
    publisher = node.create_publisher(JointState, "timer", 10)
    grid = Grid(period_ns)
    end_ns = grid.first_ns + round(seconds * 1e9)

    def tick() -> None:
        grid.tick()
        message = JointState(name=["leg"], effort=[0.0])
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    executor = SingleThreadedExecutor()
    executor.add_node(node)
    node.create_timer(period_ns * 1e-9, tick)
    grid.due_ns = grid.first_ns = time.monotonic_ns() + period_ns
    while time.monotonic_ns() < end_ns:
        executor.spin_once(timeout_sec=0.1)
    node.destroy_node()
    try_shutdown()
    return grid


LOOPS: dict[str, Callable[[int, float], Grid]] = {"nanosleep": nanosleep, "timer": timer}


if __name__ == "__main__":
    grid = LOOPS[sys.argv[1]](round(1e9 / float(sys.argv[2])), float(sys.argv[3]))
    print(json.dumps(grid.figures()))
