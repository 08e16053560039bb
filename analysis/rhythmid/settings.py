"""The parts of an experiment: forcing, delays, noise, time mode, safety limits, recording."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.time_table import read_time_table


@dataclass(frozen=True)
class Forcing:
    """Periodic forcing amplitude [N] cos(2π frequency [Hz] t + phase [rad]); amplitude 0 switches it off."""

    amplitude: float = 1.0
    frequency: float = 1.0
    phase: float = 0.0


@dataclass(frozen=True)
class Delay:
    """A transport delay: constant [s], or a profile of (seconds since start, delay [s]) joined by straight lines."""

    constant: float = 0.0
    profile: Path | None = None

    def table(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Corner times and delays of the profile. Raises InputError when the file is not such a table."""
        if self.profile is None:
            return np.zeros(1), np.array([self.constant])
        times, delays = read_time_table(self.profile, "delay [s]")
        if np.any(delays < 0.0):
            raise InputError(f"{self.profile}: a delay cannot be negative ({delays.min():g} s)")
        return times, delays

    def release(self, stamp_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Stamps [ns] on release: stamp + delay, in order (nothing overtakes). Shapes (n,) -> (n,)."""
        times, delays = self.table()
        late = np.rint(np.interp(stamp_ns * 1e-9, times, delays) * 1e9).astype(np.int64)
        released = stamp_ns + late
        order = np.arange(len(released), dtype=np.int64)
        return np.maximum.accumulate(released - order) + order


@dataclass(frozen=True)
class Noise:
    """Measurement noise: standard deviation [m], correlation from sample to sample, rounding step [m] (0: none)."""

    measurement_std: float = 0.0
    correlation: float = 0.0
    quantisation: float = 0.0


@dataclass(frozen=True)
class TimeMode:
    """`mode` lockstep (simulated time) or realtime; `rate` [Hz]; credit `window` [samples]; process `layout`."""

    mode: Literal["lockstep", "realtime"] = "lockstep"
    rate: int = 1000
    window: int = 100
    layout: Literal["composed", "processes"] = "composed"

    @property
    def period_ns(self) -> int:
        return round(1e9 / self.rate)


@dataclass(frozen=True)
class Safety:
    """Limits of a run. The effort never exceeds `max_effort` [N]; it fades in and out over `ramp` [s].

    The excitation stops by itself when the newest measurement is older than `stale_after` [s], two successive ones lie further apart
    than `max_gap` [s] (0: as `stale_after`), the position leaves `envelope` [m] or does not change for `frozen_after` [s]
    (0: never looked at), or the speed exceeds `max_speed` [m/s]. A command that nobody renews ends after `command_timeout` [s] (0: never).
    """

    max_effort: float = 100.0
    ramp: float = 0.0
    stale_after: float = 0.5
    envelope: tuple[float, float] = (-math.inf, math.inf)
    max_speed: float = math.inf
    frozen_after: float = 0.0
    max_gap: float = 0.0
    command_timeout: float = 0.1


@dataclass(frozen=True)
class Recording:
    """What is recorded, where and how."""

    path: Path = Path("bag")
    storage: Literal["mcap", "sqlite3"] = "mcap"
    topics: tuple[str, ...] = ("excitation", "joint_states", "forcing", "run")
