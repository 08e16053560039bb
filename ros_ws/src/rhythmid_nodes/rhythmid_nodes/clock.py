"""Wall clock and an absolute periodic grid on it (clock_nanosleep with TIMER_ABSTIME)."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from .lateness import Lateness

_TIMER_ABSTIME = 1
_READINGS = (
    20  # of both clocks, of which the closest pair counts: the others may have been interrupted in between
)


class _Timespec(ctypes.Structure):
    _fields_ = [("tv_sec", ctypes.c_long), ("tv_nsec", ctypes.c_long)]


_libc = ctypes.CDLL(None, use_errno=True)


class Clock:
    """Nanoseconds since the Unix epoch that never step: CLOCK_MONOTONIC plus an offset taken once.

    Processes on one computer that start at different times agree, except for steps of the system clock in between.
    """

    def __init__(self) -> None:
        self._offset_ns = _offset_ns()

    def now(self) -> int:
        return time.monotonic_ns() + self._offset_ns

    def sleep_until(self, due_ns: int) -> None:
        """Sleep until `due_ns`; absolute, so an interrupted or late sleep does not shift the next one."""
        seconds, nanoseconds = divmod(due_ns - self._offset_ns, 1_000_000_000)
        wake = _Timespec(seconds, nanoseconds)
        _libc.clock_nanosleep(time.CLOCK_MONOTONIC, _TIMER_ABSTIME, ctypes.byref(wake), None)


def _offset_ns() -> int:
    """Time since the Unix epoch minus that of CLOCK_MONOTONIC, to within the time that the closest of some readings takes.

    On a busy computer a reading may be interrupted for milliseconds between the two clocks, which would shift every stamp.
    """
    best_ns, offset_ns = None, 0
    for _ in range(_READINGS):
        before = time.monotonic_ns()
        epoch = time.time_ns()
        after = time.monotonic_ns()
        if best_ns is None or after - before < best_ns:
            best_ns, offset_ns = after - before, epoch - (before + after) // 2
    return offset_ns


class Worker:
    """A thread that ends on request, can be started again, and passes an exception on to the node. With a `priority` the whole process gets it."""

    def __init__(self, name: str, body: Callable[[], None], priority: int = 0) -> None:
        self.stopping = threading.Event()
        self.failure: BaseException | None = None
        self._name = name
        self._body = body
        self._priority = priority
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start the thread; it must not be running."""
        self.stopping.clear()
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Request the end of the thread, and wait for it."""
        self.stopping.set()
        if self._thread is not None and self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        if self._priority:
            try:
                _prioritise(self._priority)
            except OSError as refused:
                print(
                    f"warning: no SCHED_FIFO priority {self._priority}: {refused.strerror}", file=sys.stderr
                )
        try:
            self._body()
        except BaseException as failure:
            self.failure = failure


def _prioritise(priority: int) -> None:
    """SCHED_FIFO for all threads of this process: a clock thread in time is of no use while those wait that receive what it sends or judges."""
    for thread in os.listdir("/proc/self/task"):
        with suppress(ProcessLookupError):  # it has ended
            os.sched_setscheduler(int(thread), os.SCHED_FIFO, os.sched_param(priority))


class Grid(Worker):
    """Calls `tick(stamp_ns)` at every multiple of `period_ns` of the clock, without drift.

    After an overrun of up to `catch_up` seconds the missed ticks follow at once, each with its own grid stamp. After a longer one
    only the newest does, and `skipped` counts the others. How late they came since the last start is in `figures`.
    """

    def __init__(
        self,
        clock: Clock,
        period_ns: int,
        tick: Callable[[int], None],
        priority: int = 0,
        catch_up: float = 0.0,
    ) -> None:
        super().__init__("grid", self._loop, priority)
        self.skipped = 0
        self._catch_up_ns = max(round(catch_up * 1e9), period_ns)
        self._clock, self._period_ns, self._tick = clock, period_ns, tick
        self._lateness = Lateness(period_ns)
        self._first_ns = self._last_ns = 0

    def figures(self) -> dict[str, str]:
        """Ticks per second so far, and how late they came, for /diagnostics."""
        elapsed = (self._last_ns - self._first_ns) * 1e-9
        rate = (self._lateness.count - 1) / elapsed if elapsed > 0.0 else 0.0
        return {"rate_hz": f"{rate:.3f}", "skipped": str(self.skipped), **self._lateness.summary("lateness")}

    def _loop(self) -> None:
        self._lateness = Lateness(self._period_ns)
        self._first_ns = due = (self._clock.now() // self._period_ns + 2) * self._period_ns
        while not self.stopping.is_set():
            self._clock.sleep_until(due)
            self._last_ns = self._clock.now()
            self._lateness.add(max(0, self._last_ns - due))
            if self._last_ns - due > self._catch_up_ns:
                missed = (self._last_ns - due) // self._period_ns
                self.skipped += missed
                due += missed * self._period_ns
            self._tick(due)
            due += self._period_ns
