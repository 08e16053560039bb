"""Whether a machine may be excited, judged by its measurements: fresh, without gaps, moving, and within its limits."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass

from .sample import Sample

_DRIFT = 1e-3
"""Seconds a second by which the offset of a robot's clock may drift: ten times what quartz clocks do."""


@dataclass(frozen=True)
class Limits:
    """Limits of the measurements; the default only refuses stale measurements and values that are not numbers.

    Attributes
    ----------
    stale_after : largest age [s] of the newest measurement, by its arrival and by its stamp; 0: any.
    low, high : range of positions.
    speed : largest |v| [1/s].
    frozen_after : time [s] for which the position may stay exactly the same; 0: any.
    gap : largest step [s] from one stamp to the next, forwards or backwards; 0: as `stale_after`.
    unit : of positions, for messages.
    other_clock : whether the stamps come from another clock than this computer's. Their age is then relative to the smallest difference so far.
    """

    stale_after: float = 0.5
    low: float = -math.inf
    high: float = math.inf
    speed: float = math.inf
    frozen_after: float = 0.0
    gap: float = 0.0
    other_clock: bool = False
    unit: str = "m"


class Watch:
    """Judges measurements one by one (`hear`) and their absence (`danger`), from any thread. Times are nanoseconds of this computer's clock.
    `measured` says in messages what is measured, and where.

    Attributes
    ----------
    speed : of the newest measurement, from successive positions if the message does not contain it; NaN before the first one.
    """

    def __init__(self, limits: Limits, measured: str = "the machine") -> None:
        self.speed = math.nan
        self._limits, self._measured = limits, measured
        self._lock = (
            threading.Lock()
        )  # its own: a busy clock thread that holds another for long keeps no measurement waiting
        self._newest: Sample | None = None
        self._others = ""  # joints that the messages name instead
        self._gap = 0.0
        self._arrived_ns = self._moved_ns = 0
        self._offset_ns = (
            math.inf
        )  # smallest arrival - stamp: the difference of the clocks and the shortest way

    def hear(self, sample: Sample, arrived_ns: int) -> None:
        """Store a measurement; `danger` judges it."""
        with self._lock:
            self._take(sample, arrived_ns)

    def _take(self, sample: Sample, arrived_ns: int) -> None:
        before = self._newest
        self._gap = 0.0 if before is None else (sample.stamp_ns - before.stamp_ns) * 1e-9
        self.speed = _speed(sample, before)
        if before is None or sample.position != before.position:
            self._moved_ns = arrived_ns
        drifted = _DRIFT * (arrived_ns - self._arrived_ns)
        self._offset_ns = min(self._offset_ns + drifted, arrived_ns - sample.stamp_ns)
        self._newest, self._arrived_ns = sample, arrived_ns

    def hear_others(self, joints: Sequence[str]) -> None:
        """Note which joints a message names that lacks the one."""
        if self._newest is None:
            self._others = f"; the messages there name {', '.join(joints) or 'no joint'}"

    def danger(self, now_ns: int) -> str:
        """Reason why the machine must not be excited now; empty if it may."""
        with self._lock:
            sample, stale = self._newest, self._limits.stale_after
            if sample is None:
                return f"no measurement of {self._measured} yet{self._others}" if stale > 0.0 else ""
            return self._state(sample) or self._age(sample, now_ns)

    def _state(self, sample: Sample) -> str:
        limits = self._limits
        if not math.isfinite(sample.position) or not limits.low <= sample.position <= limits.high:
            return f"the position {sample.position:g} {limits.unit} is outside the envelope [{limits.low:g}, {limits.high:g}] {limits.unit}"
        if abs(self.speed) > limits.speed:
            return f"the speed of {self.speed:g} {limits.unit}/s exceeds {limits.speed:g} {limits.unit}/s"
        return ""

    def _age(self, sample: Sample, now_ns: int) -> str:
        limits = self._limits
        stale = limits.stale_after or math.inf
        age = (now_ns - self._arrived_ns) * 1e-9
        if age > stale:
            return f"the newest measurement is {age:.3f} s old, allowed are {stale:g} s"
        behind = (now_ns - sample.stamp_ns - (self._offset_ns if limits.other_clock else 0)) * 1e-9
        if abs(behind) > stale:
            side = "ago" if behind > 0.0 else "ahead"
            return (
                f"the newest measurement is stamped {abs(behind):.3f} s {side}, allowed are {stale:g} s"
                " (for a robot with another clock set measurement_clock: other)"
            )
        if abs(self._gap) > (limits.gap or stale):
            return (
                f"the measurements' stamps step by {self._gap:.3f} s, allowed are {limits.gap or stale:g} s"
            )
        still = (self._arrived_ns - self._moved_ns) * 1e-9
        if still > limits.frozen_after > 0.0:
            return f"the position has been exactly {sample.position:g} {limits.unit} for {still:.3f} s, allowed are {limits.frozen_after:g} s"
        return ""


def _speed(sample: Sample, before: Sample | None) -> float:
    if not math.isnan(sample.velocity):
        return sample.velocity
    if before is None or sample.stamp_ns == before.stamp_ns:
        return math.nan
    return (sample.position - before.position) / ((sample.stamp_ns - before.stamp_ns) * 1e-9)
