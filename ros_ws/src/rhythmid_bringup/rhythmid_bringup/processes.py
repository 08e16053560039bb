"""Supervised processes: output is forwarded line by line, and processes are ended as by ros2 launch (SIGINT, SIGTERM, SIGKILL)."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

_REFUSAL = "error: "
_NICE = -10
GRACE = 5.0  # seconds between one signal and the next


class Supervised:
    """A child process in its own session, so that Ctrl-C reaches only the supervisor.

    `tell(name, line)` gets its output, except the line with which it refuses its input, which is `refusal`.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        tell: Callable[[str, str], None],
    ) -> None:
        self.name = name
        self.refusal = ""
        self._tell = tell
        self._process = subprocess.Popen(
            command,
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._pass_on, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        """Exit code, minus the signal's number if killed; None while it runs."""
        return self._process.poll()

    @property
    def suspended(self) -> bool:
        """Whether it has been stopped (SIGSTOP) and cannot react to a signal."""
        try:
            status = Path(f"/proc/{self._process.pid}/stat").read_text(encoding="ascii", errors="replace")
        except OSError:
            return False
        return status.rpartition(")")[2].split()[0] in "Tt"

    def hurry(self) -> None:
        """Raise its priority if the user has the right; call this before it has created threads."""
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, self._process.pid, _NICE)
            # each session is a scheduling group, whose niceness counts relative to others
            Path(f"/proc/{self._process.pid}/autogroup").write_text(str(_NICE), encoding="ascii")

    def signal(self, number: signal.Signals) -> None:
        if self.returncode is None:
            self._process.send_signal(number)

    def join_output(self) -> None:
        """Wait until all output of an ended process has been forwarded."""
        self._reader.join(1.0)

    def _pass_on(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(_REFUSAL):
                self.refusal = f"{self.name}: {line.removeprefix(_REFUSAL).strip()}"
            else:
                self._tell(self.name, line.rstrip())


def end(processes: Sequence[Supervised], meanwhile: Callable[[], None] = lambda: time.sleep(0.02)) -> None:
    """End all processes; `meanwhile` is called while waiting."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        for process in processes:
            process.signal(signal.SIGKILL if process.suspended else number)
        patience = time.monotonic() + GRACE
        while time.monotonic() < patience:
            if all(process.returncode is not None for process in processes):
                return
            meanwhile()
