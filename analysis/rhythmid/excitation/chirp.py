"""Linear chirps, one after another, starting at different phases of the machine's period (paper, equation (14)).

With `shift: {period: T, count: K}` each chirp takes sweep + gap + T/K. K chirps then start at K phases spread evenly over T.
Together they form a comb whose harmonics fall into separate frequency bins (period T_c = (n + 1/K) T).
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from rhythmid.excitation.excitation import Array, Excitation


class Shift(BaseModel):
    """Spread the starts of `count` repetitions evenly over `period` [s]."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    period: Annotated[float, Field(gt=0)]
    count: Annotated[int, Field(ge=1)]


class Chirp(Excitation):
    """u_i(t) = A sin(2π (f₀ t + (f₁ − f₀) t²/(2 S)) + φ) during the sweep S, zero in the gap that follows.

    With A = 0.004 N, band 0 to 7 Hz and S = 30 s this is 0.004 sin(7π t²/30), the paper's equation (14). `warm_up`
    further repetitions come first. `start_delay` [s] of silence precedes all.
    """

    type: Literal["chirp"] = "chirp"
    amplitude: float
    band: tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]] = (0.0, 7.0)
    sweep: Annotated[float, Field(gt=0)] = 30.0
    phase: float = 0.0
    repetitions: Annotated[int, Field(ge=1)] = 1
    warm_up: Annotated[int, Field(ge=0)] = 0
    shift: Shift | None = None
    gap: Annotated[float, Field(ge=0)] = 0.0
    start_delay: Annotated[float, Field(ge=0)] = 0.0

    @model_validator(mode="after")
    def _band_is_wide(self) -> "Chirp":
        if self.band[0] == self.band[1]:
            raise ValueError("band: two different frequencies are needed; use a multisine for a single one")
        return self

    @property
    def cycle(self) -> float:
        """Time [s] from the start of one chirp to the start of the next."""
        return self.sweep + self.gap + (self.shift.period / self.shift.count if self.shift else 0.0)

    @property
    def duration(self) -> float:
        return self.start_delay + (self.warm_up + self.repetitions) * self.cycle

    @property
    def peak(self) -> float:
        return abs(self.amplitude)

    def shape(self, time: Array) -> Array:
        local = time - self.start_delay
        # a small offset: a sample that rounding puts just before a start belongs to the chirp that starts there
        t = local - np.floor(local / self.cycle + 1e-9) * self.cycle
        low, high = self.band
        angle = 2 * math.pi * (low * t + (high - low) * t**2 / (2 * self.sweep)) + self.phase
        return np.where((local >= -1e-9) & (t < self.sweep), self.amplitude * np.sin(angle), 0.0)
