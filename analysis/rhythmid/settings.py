"""The parts of an experiment: forcing, delays, noise, time mode, safety limits, recording."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, ConfigDict, Field

from rhythmid.errors import InputError
from rhythmid.time_table import read_time_table
from rhythmid.validation import Number, Range, Whole

Topic = Literal[
    "excitation", "command", "forcing", "plant/joint_states", "joint_states", "run", "diagnostics"
]
KEYS = ConfigDict(extra="forbid")  # an unknown key is an error


@dataclass(frozen=True)
class Forcing:
    """Periodic forcing amplitude [N] cos(2π frequency [Hz] t + phase [rad]); amplitude 0 switches it off."""

    __pydantic_config__ = KEYS

    amplitude: Number = 1.0
    frequency: Annotated[Number, Field(ge=1e-6, le=1e6)] = 1.0
    phase: Number = 0.0


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
        """Stamps [ns] on release: stamp + delay, in order (no message overtakes another). Shapes (n,) -> (n,)."""
        released = stamp_ns + profile_delay(stamp_ns, *self.table())
        order = np.arange(len(released), dtype=np.int64)
        return np.maximum.accumulate(released - order) + order


def profile_delay(
    since_ns: NDArray[np.int64] | int, times: NDArray[np.float64], delays: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Delay [ns] of a message with a stamp `since_ns` [ns] after the start, by a profile's corner times and delays [s]."""
    return np.rint(np.interp(np.multiply(since_ns, 1e-9), times, delays) * 1e9).astype(np.int64)


@dataclass(frozen=True)
class Noise:
    """Measurement noise: standard deviation [m], correlation from sample to sample, rounding step [m] (0: none)."""

    __pydantic_config__ = KEYS

    measurement_std: Annotated[Number, Field(ge=0)] = 0.0
    correlation: Annotated[Number, Field(ge=0, le=0.9999)] = 0.0
    quantisation: Annotated[Number, Field(ge=0)] = 0.0


@dataclass(frozen=True)
class TimeMode:
    """`mode` lockstep (simulated time) or realtime; `rate` [Hz]; credit `window` [samples]; process `layout`."""

    __pydantic_config__ = KEYS

    mode: Literal["lockstep", "realtime"] = "lockstep"
    rate: Annotated[Whole, Field(ge=1, le=100_000)] = 1000
    window: Annotated[Whole, Field(ge=1, le=100)] = 100
    layout: Literal["composed", "processes"] = "composed"

    @property
    def period_ns(self) -> int:
        return round(1e9 / self.rate)


@dataclass(frozen=True)
class Safety:
    """Limits of a run. The effort never exceeds `max_effort` [N]; it fades in and out over `ramp` [s].

    The excitation stops by itself if the newest measurement is older than `stale_after` [s], two successive stamps differ by more
    than `max_gap` [s] (0: as `stale_after`), the position leaves `envelope` [m] or does not change for `frozen_after` [s]
    (0: not checked), or the speed exceeds `max_speed` [m/s]. A command that is not renewed ends after `command_timeout` [s] (0: never).
    """

    __pydantic_config__ = KEYS

    max_effort: Annotated[Number, Field(ge=0)] = 100.0
    ramp: Annotated[Number, Field(ge=0)] = 0.0
    stale_after: Annotated[Number, Field(ge=1e-3)] = 0.5
    envelope: Range = (-math.inf, math.inf)
    max_speed: Annotated[float, Field(ge=0)] = math.inf
    frozen_after: Annotated[Number, Field(ge=0)] = 0.0
    max_gap: Annotated[Number, Field(ge=0)] = 0.0
    command_timeout: Annotated[Number, Field(ge=0)] = 0.1


@dataclass(frozen=True)
class Recording:
    """What is recorded, where and how."""

    __pydantic_config__ = KEYS

    path: Path = Path("bag")
    storage: Literal["mcap", "sqlite3"] = "mcap"
    topics: Annotated[tuple[Topic, ...], BeforeValidator(lambda given: given or ())] = (
        "excitation", "joint_states", "forcing", "run",
    )  # fmt: skip
