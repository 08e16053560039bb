"""The messages of one recorded topic, checked by the stamps of their headers."""

from __future__ import annotations

_STREAM = "sensor_msgs/msg/JointState"


class Track:
    """One recorded topic."""

    def __init__(self, period_ns: int) -> None:
        self.received = 0
        self.type_name = ""
        self.has_header = False
        self._period_ns = period_ns
        self._stamped = self._duplicates = self._backwards = self._longest_ns = 0
        self._first_ns = self._previous_ns = self._last_ns = 0
        self._on_grid = True

    @property
    def is_stream(self) -> bool:
        """Whether it carries one message for every sample of the grid."""
        return self.type_name == _STREAM

    def add(self, stamp_ns: int) -> None:
        """Register the header stamp [ns] of the next message."""
        if self._stamped == 0:
            self._first_ns = self._previous_ns = self._last_ns = stamp_ns
        else:
            step = stamp_ns - self._previous_ns
            self._duplicates += step == 0
            self._backwards += step < 0
            self._on_grid = self._on_grid and step % self._period_ns == 0
            self._longest_ns = max(self._longest_ns, step)
            self._last_ns = max(self._last_ns, stamp_ns)
            self._previous_ns = stamp_ns
        self._stamped += 1

    def check(self) -> str:
        """Rate, duplicates, steps back, longest interval; missing samples if the stamps are on a grid."""
        span_ns = self._last_ns - self._first_ns
        if span_ns == 0:
            return ""
        rate = (self._stamped - 1) / (span_ns * 1e-9)
        found = f", {rate:.3f} Hz, {self._duplicates} duplicates, {self._backwards} backwards"
        if self.is_stream and self._on_grid:
            found += f", {span_ns // self._period_ns + 1 - (self._stamped - self._duplicates)} missing"
        return f"{found}, longest interval {self._longest_ns * 1e-6:.3f} ms"
