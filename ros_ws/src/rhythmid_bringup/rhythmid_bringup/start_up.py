"""A signal before the nodes of a run are started: loading ROS takes seconds, and who stops the command then is told that nothing was recorded."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import typer

STOPPED = "stopped by the user before the run began: nothing is recorded"


@dataclass
class StartUp:
    """Whether a signal `came`, and whether the run has `begun`; then the signals are the supervisor's."""

    came: bool = False
    begun: bool = False


@contextmanager
def start_up() -> Iterator[StartUp]:
    """Within the block, until `begun`, SIGINT and SIGTERM end the command with one line and exit code 0."""
    state = StartUp()

    def stop(_number: int, _frame: object) -> None:
        state.came = True
        raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield state
    except BaseException:  # an import may turn the interruption into an error of its own
        if state.begun or not state.came:
            raise
        print(STOPPED, file=sys.stderr)
        raise typer.Exit from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
