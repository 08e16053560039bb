"""A command in memory, as the samples to be played."""

import math

import numpy as np
from pydantic import ConfigDict, Field

from rhythmid.design.crest_factor import crest_factor
from rhythmid.errors import InputError
from rhythmid.excitation.excitation import Array, Excitation

DIGITS = 10  # digits kept, relative to the largest effort; the file is short and holds exactly the values of the prediction
BELOW = 1.0 - 1e-9  # factor that keeps a rounded peak within the limit


class Waveform(Excitation):
    """Sample k [N] is held from time k · period [s] until the next sample."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    values: Array
    period: float = Field(gt=0)

    @property
    def duration(self) -> float:
        return len(self.values) * self.period

    @property
    def peak(self) -> float:
        return float(np.max(np.abs(self.values), initial=0.0))

    @property
    def crest_factor(self) -> float:
        return crest_factor(self.values)

    def shape(self, time: Array) -> Array:
        index = np.floor(np.asarray(time) / self.period + 1e-6).astype(np.int64)
        return self.values[np.clip(index, 0, len(self.values) - 1)]

    def with_peak(self, peak: float) -> "Waveform":
        """The same shape with its largest effort at `peak` [N] or a billionth below, rounded to ten digits."""
        if peak == 0.0:
            return Waveform(values=np.zeros(len(self.values)), period=self.period)
        digits = DIGITS - math.floor(math.log10(abs(peak)))
        return Waveform(values=np.round(self.values * (peak * BELOW / self.peak), digits), period=self.period)


def sampled(excitation: Excitation, duration: float, rate: int) -> Waveform:
    """The first `duration` [s] of an excitation on a grid of `rate` [Hz]. Raises InputError when it is silent there."""
    period_ns = round(1e9 / rate)
    count = max(1, round(duration * 1e9 / period_ns))
    values = excitation(np.arange(count, dtype=np.int64) * period_ns * np.float64(1e-9))
    if not np.any(values):
        raise InputError("the command is silent: its band and duration leave nothing to play")
    return Waveform(values=values, period=period_ns * 1e-9)
