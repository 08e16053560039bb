"""The base of all nodes of the graph: declared parameters, diagnostics, start and end."""

from __future__ import annotations

import ctypes
import gc
import math
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.parameter import Parameter as RosParameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from rhythmid.errors import InputError
from rhythmid.simulation.command_hold import TIMEOUT

from .authority import UNNAMED
from .diagnostics import Diagnostics
from .lifecycle import LIFECYCLE
from .managed_node import ManagedNode
from .parameters import Parameter, declare
from .waiting import Waiting

_PR_SET_PDEATHSIG = 1
_SUPERVISOR = "RHYTHMID_SUPERVISOR"  # process id of the supervisor, which itself says what is waited for
_WAITING_PERIOD = 0.5  # seconds between two checks whether the node still waits
_LAST_WORDS = 0.1  # seconds
_ANSWERING = 1.0  # seconds in which the answer to a request that ends the node is received: the middleware discards the messages of a node that has gone
_NAMING = (
    2.0  # seconds that a tripped node waits for the name of a foreign node, which arrives after its messages
)

RATE = Parameter("rate", 1000, "samples per second of the common grid", "Hz", (1, 100_000))
TIME_MODE = Parameter(
    "time_mode", "realtime", "clock of the graph: the machine's, or simulated time driven by the data",
    choices=("realtime", "lockstep"),
)  # fmt: skip
JOINT = Parameter("joint", "leg", "joint that the messages speak of")
WINDOW = Parameter("window", 100, "lockstep: samples in flight at most", "samples", (1, 100))
COUNT = Parameter("count", 0, "samples of the whole run; 0: no end (realtime only)", "samples", (0, 2**31))
PRIORITY = Parameter(
    "priority",
    0,
    "SCHED_FIFO priority of the process; 0: none; needs the right to set it",
    bounds=(0, 99),
)
CATCH_UP = Parameter(
    "catch_up",
    TIMEOUT,
    "realtime: overrun up to which missed samples follow; after a longer one only the newest does",
    "s",
    (0.0, 10.0),
)
"""By default as long as a command is held: after a longer overrun the robot has been given up already."""

SAMPLED = (RATE, TIME_MODE, JOINT, WINDOW, COUNT, PRIORITY, CATCH_UP)
"""Of a node that sends or takes one message of a joint for each sample of a run."""

AUTOSTART = Parameter("autostart", True, "configures and activates itself; else ~/change_state does")
_NO_SIM_TIME = "parameter use_sim_time = True: the nodes take no time from /clock; for simulated time use time_mode = 'lockstep'"


def supervised() -> bool:
    """Whether another process starts this one, says what is waited for, and ends the run when a node dies."""
    return _SUPERVISOR in os.environ


def lapse_notice(timeout: float) -> str:
    """Log message of a node that holds a command for at most `timeout` seconds."""
    return f"a command was not renewed within {timeout:g} s: it fades to zero"


class GraphNode(ManagedNode):
    """A managed node with `values` (its parameters by name), /diagnostics, and workers that end with it."""

    def __init__(self, name: str, parameters: tuple[Parameter, ...], **options: Any) -> None:
        super().__init__(name, **options)
        self.values = declare(self, (*parameters, AUTOSTART))
        if self.get_parameter("use_sim_time").value:
            raise InputError(_NO_SIM_TIME)
        self.add_on_set_parameters_callback(_refuse_sim_time)
        self.lockstep = self.values["time_mode"] == "lockstep"
        self._unnamed = ""  # an error that waits for the name of a node
        self.tripped = ""  # why the node stopped its work early, if it did; the process then ends with code 1
        self.diagnostics = Diagnostics(self, self._all_figures, self._all_obstacles, lambda: self.tripped)
        self._waiting_lines = Waiting()
        if not supervised():
            self.create_timer(_WAITING_PERIOD, self._tell_waiting)
        self.manage(self.values["autostart"])

    @property
    def period_ns(self) -> int:
        """Period of the common grid, for nodes that have the parameter `rate`."""
        return round(1e9 / self.values["rate"])

    def figures(self) -> dict[str, str]:
        """Key-value pairs for /diagnostics."""
        return {}

    def obstacles(self) -> list[str]:
        """Reason why the node is not ready; empty if it is ready."""
        return []

    def _all_figures(self) -> dict[str, str]:
        return {LIFECYCLE: self.managed_state, **(self.figures() if self.configured else {})}

    def _all_obstacles(self) -> list[str]:
        return self.obstacles() if self.active else [self.managed_state]

    def _tell_waiting(self) -> None:
        obstacles = self.obstacles() if self.active and not self.tripped else []
        if self._waiting_lines.due(bool(obstacles), time.monotonic()):
            self.get_logger().warning(f"waiting: {'; '.join(obstacles)}")

    def trip(self, reason: str) -> None:
        """Stop permanently because of `reason`: report it, and end the process soon. The first reason counts, until an unnamed node gets its name."""
        if self.tripped and UNNAMED not in self.tripped:
            return
        self.tripped = reason
        self.report(f"stopped: {reason}")
        if UNNAMED in reason:
            self.create_timer(_NAMING, self.end)
        else:
            self.end()

    def report(self, line: str) -> None:
        """Log an error, once: a line about an unnamed node waits until its name is known, `_NAMING` seconds at most."""
        self._unnamed = line if UNNAMED in line else ""
        if self._unnamed:
            self.create_timer(_NAMING, self._report_unnamed)
        else:
            self.get_logger().error(line)

    def _report_unnamed(self) -> None:
        line, self._unnamed = self._unnamed, ""
        if line:
            self.get_logger().error(line)

    def notice(self, text: str) -> None:
        """Have `text` logged as a warning, once; clock threads use this."""
        self.diagnostics.notice(text)

    def begin(self) -> None:
        """Activate the node when every node of the process is configured, unless another program does this."""
        if self.values["autostart"]:
            self.trigger_activate()

    def close(self) -> None:
        """Stop the effort, end the workers and report the last figures; the context is still valid."""
        if self.configured:
            self.stand_down()
            self.finish()
        for worker in self.workers:
            worker.stop()
        self._report_unnamed()
        self.diagnostics.publish_last()


def _refuse_sim_time(parameters: list[RosParameter]) -> SetParametersResult:
    wanted = any(parameter.name == "use_sim_time" and parameter.value for parameter in parameters)
    return SetParametersResult(successful=not wanted, reason=_NO_SIM_TIME if wanted else "")


def _end_with_supervisor() -> None:
    """Make the kernel send SIGINT when the supervising process dies for any reason."""
    supervisor = os.environ.get(_SUPERVISOR)
    if supervisor is not None:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
        if os.getppid() != int(supervisor):
            sys.exit(1)


def serve(build: Sequence[Callable[[], GraphNode]], arguments: list[str]) -> int:
    """Run the nodes in this process on one EventsExecutor until SIGINT, SIGTERM or a failure; the exit code.

    0: stopped on request; 2: a parameter or other input was refused, in one line; 1: a node stopped early, or an internal error.
    """
    asked: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: asked.append(received))
    _end_with_supervisor()
    sys.setswitchinterval(2e-4)  # a waiting clock thread gets the interpreter within 0.2 ms
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as problem:  # --ros-args that cannot be parsed; rcl adds the places in its sources
        print(f"error: {' '.join(str(problem).split(', at /')[0].split())}", file=sys.stderr)
        return 2
    executor = EventsExecutor()
    nodes: list[GraphNode] = []
    problems: list[BaseException] = []
    try:
        for make in build:
            nodes.append(make())
            executor.add_node(nodes[-1])
        _spin(executor, nodes, asked)
    except Exception as problem:
        problems.append(problem)
    for node in nodes:
        try:
            node.close()
        except Exception as problem:
            problems.append(problem)
        if node.failure is not None and node.failure not in problems:
            problems.append(node.failure)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    try_shutdown()
    for problem in problems:
        if isinstance(problem, InputError):
            print(f"error: {problem}", file=sys.stderr)
        else:
            traceback.print_exception(problem)
    if problems:
        return 2 if isinstance(problems[0], InputError) else 1
    return 1 if any(node.tripped for node in nodes) else 0


def _spin(executor: Executor, nodes: Sequence[GraphNode], asked: list[int]) -> None:
    """Serve callbacks until `asked` is filled by a signal or a node is done or has failed, and a moment more for what has been
    delivered but not yet served, or longer for the answer to a request that has ended a node; raises what a node failed of."""
    gc.collect()
    gc.freeze()  # later collections look at young objects only, which takes microseconds
    for node in nodes:
        node.begin()
    look_at = 0.0
    end_at = math.inf
    failure: BaseException | None = None
    while time.monotonic() < end_at:
        executor.spin_once(timeout_sec=0.1)  # EventsExecutor.spin() never returns on a signal
        if asked or time.monotonic() > look_at:
            look_at = time.monotonic() + 0.1
            failure = failure or next((node.failure for node in nodes if node.failure is not None), None)
            if end_at == math.inf and (asked or failure is not None or any(node.done for node in nodes)):
                requested = not asked and any(node.ended_by_transition for node in nodes)
                end_at = time.monotonic() + (_ANSWERING if requested else _LAST_WORDS)
                for node in nodes:
                    if node.configured:
                        node.stand_down()
    if failure is not None:
        raise failure


def run(build: Callable[[], GraphNode]) -> None:
    """Entry point of a process that holds one node."""
    sys.exit(serve([build], sys.argv))
