"""`rhythmid watch` of a running machine: the node `twin` in a separate process, and its output on the terminal."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from rich.console import Console
from rich.live import Live

from rhythmid.errors import InputError
from rhythmid_nodes.qos import latched

from .board import drawn
from .environment import run_environment
from .processes import Supervised, end
from .run import interruptions
from .watch_lines import WatchLines

NAMESPACE = "/hopper"  # of rhythmid's own nodes, whose topics are watched where no signals are given
REFRESH = 4.0  # a second


class Board(Node):
    """The newest status of every name on /diagnostics."""

    def __init__(self) -> None:
        super().__init__("watch", namespace=NAMESPACE)
        self.newest: dict[str, DiagnosticStatus] = {}
        self.create_subscription(DiagnosticArray, "/diagnostics", self._take, latched(100))

    def _take(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.newest[status.name] = status


def parameters(options: Mapping[str, Any]) -> dict[str, Any]:
    """The node's parameters from the command's options."""
    paths = {
        "model": "model", "signals": "signals", "calibration": "calibration", "save_calibration": "save_calibration",
        "result": "json",
    }  # fmt: skip
    given = {
        name: str(Path(options[key]).absolute()) for name, key in paths.items() if options[key] is not None
    }
    folders = [str(Path(folder).absolute()) for folder in options["elements"]]
    given |= {name: options[name] for name in ("healthy", "false_alarms", "diagnose")}
    return {**given, **({"elements": folders} if folders else {})}


def watch(**options: Any) -> int:
    """Watch until Ctrl-C; the exit code is 1 when the node died. Raises InputError when it refuses its parameters."""
    folder = Path(tempfile.mkdtemp(prefix="rhythmid-"))
    file = folder / "twin.yaml"
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters(options)}}), encoding="utf-8")
    environment = run_environment(os.environ, None, folder)
    environment["RHYTHMID_SUPERVISOR"] = str(os.getpid())
    os.environ.update(environment)
    line = [sys.executable, "-P", "-m", "rhythmid_nodes.twin", "--ros-args", "--params-file", str(file)]
    line += ["-r", f"__ns:={NAMESPACE}"] if options["signals"] is None else []
    said: list[str] = []
    console = Console(stderr=True)
    with interruptions() as interrupted:
        process = Supervised("twin", line, environment, lambda _name, text: said.append(text))
        try:
            _show(process, console, interrupted)
        finally:
            end([process])
    process.join_output()
    shutil.rmtree(folder, ignore_errors=True)
    if process.returncode == 2:
        raise InputError(process.refusal.removeprefix("twin: "))
    for text in said:
        console.print(text, markup=False)
    return 0 if process.returncode in (0, -signal.SIGINT) else 1


def _show(process: Supervised, console: Console, interrupted: Callable[[], bool]) -> None:
    """Draw the display until the user or the node ends it; it stays on the screen if the user has ended it. Without a terminal, print
    a line at each change instead, and one at the end."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    board, executor = Board(), EventsExecutor()
    executor.add_node(board)
    try:
        if console.is_terminal:
            with Live(drawn({}), console=console, refresh_per_second=REFRESH, transient=True) as live:
                while process.returncode is None and not interrupted():
                    executor.spin_once(timeout_sec=0.1)
                    live.update(drawn(board.newest))
            if process.returncode is None:
                console.print(drawn(board.newest))
        else:
            lines = WatchLines()
            while process.returncode is None and not interrupted():
                executor.spin_once(timeout_sec=0.1)
                for line in lines.take(board.newest):
                    console.print(line, markup=False, highlight=False, soft_wrap=True)
            if process.returncode is None:
                console.print(lines.end(), markup=False, highlight=False, soft_wrap=True)
    finally:
        executor.shutdown()
        board.destroy_node()
        try_shutdown()
