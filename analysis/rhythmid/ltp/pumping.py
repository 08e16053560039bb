"""Pumping: the periodic forcing f0(t) that keeps the machine on its limit cycle. Its phase is the time reference.

All harmonic transfer functions are stated in *cycle time*, which is zero where the fundamental of f0 has phase zero, so
they do not depend on when the recording began.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.errors import InputError
from rhythmid.record.fourier_series import fourier_series
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import spline

Array = NDArray[np.float64]
NOT_PERIODIC = 0.05  # share of a forcing that its periodic part may leave unexplained
# knots in a period of the forcing as a signal; a cubic spline then approximates a sinusoid to 1e-12
GRID = 1024


@dataclass(frozen=True, eq=False)
class Pumping:
    """Periodic forcing f0(t) = Re Σ_h F_h exp(j h ω_p (t − origin)), h = 0, 1, …, in the record's time t [s].

    `coefficients` complex128[H + 1] [N] with F_1 real and nonnegative by choice of the `origin` [s]. `frequency` [Hz]
    is 1/T; `source` names its origin. Without forcing all coefficients are zero.
    """

    frequency: float
    coefficients: NDArray[np.complex128]
    origin: float = 0.0
    source: str = "given"

    @classmethod
    def cosine(
        cls, amplitude: float, frequency: float, phase: float = 0.0, source: str = "given"
    ) -> "Pumping":
        """f0(t) = amplitude [N] cos(2π frequency [Hz] t + phase [rad])."""
        turned = phase if amplitude >= 0 else phase + np.pi
        origin = -((turned + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi * frequency)
        return cls(frequency, np.array([0.0, abs(amplitude)], dtype=complex), origin, source)

    @property
    def period(self) -> float:
        """T [s]."""
        return 1.0 / self.frequency

    @property
    def omega(self) -> float:
        """Pumping frequency ω_p [rad/s]."""
        return 2.0 * np.pi * self.frequency

    @property
    def active(self) -> bool:
        """Whether there is any forcing."""
        return bool(np.any(self.coefficients != 0.0))

    def __call__(self, cycle_time: Array) -> Array:
        """Forcing [N] at cycle times [s] (zero at the origin); shapes (n,) -> (n,)."""
        total = np.zeros(len(cycle_time))
        for h in np.flatnonzero(self.coefficients):
            angle = self.omega * h * cycle_time
            total += self.coefficients[h].real * np.cos(angle) - self.coefficients[h].imag * np.sin(angle)
        return total

    def signal(self) -> PPoly | None:
        """The forcing over one period of cycle time and a sixteenth around it; None where there is none."""
        if not self.active:
            return None
        margin = GRID // 16
        t = self.period / GRID * np.arange(-margin, GRID + margin + 1, dtype=np.float64)
        return spline(t, self(t))


def pumping_of_channel(channel: Channel, source: str = "forcing channel") -> Pumping:
    """The pumping in a recorded forcing. Raises InputError when it is not periodic or covers < 2 periods."""
    time, value = channel.time, channel.value
    if np.ptp(value) == 0.0:
        return Pumping(1.0, np.zeros(2, dtype=complex), 0.0, f"{source} (constant)")
    try:
        law = fourier_series(time, value)
    except InputError as error:
        raise InputError(f"the forcing {error}; at least 2 are needed to know its phase") from None
    if law.left > NOT_PERIODIC * np.std(value):
        raise InputError(
            f"the forcing is not periodic: its best period of {1 / law.frequency:.6g} s leaves "
            f"{law.left / np.std(value):.0%} of it; check which channel is the forcing"
        )
    frequency, coefficients = law.frequency, law.coefficients.copy()
    coefficients[np.abs(coefficients) < 1e-9 * np.abs(coefficients).max()] = 0.0
    origin = -np.angle(coefficients[1]) / (2 * np.pi * frequency)
    turned = coefficients * np.exp(2j * np.pi * frequency * origin * np.arange(len(coefficients)))
    turned[1] = abs(turned[1])
    return Pumping(frequency, turned, float(origin), source)


def pumping_of(record: Record) -> Pumping | None:
    """Pumping from the record's forcing: its formula where one is stated, else its channel; None where it has neither."""
    law = record.forcing_law
    if law is not None:
        return Pumping.cosine(law.amplitude, law.frequency, law.phase, "stated formula")
    if record.forcing is None or len(record.forcing) < 8:
        return None
    return pumping_of_channel(record.forcing)


def active_pumping(record: Record) -> Pumping | None:
    """The record's forcing, None where there is none or it is not periodic."""
    try:
        found = pumping_of(record)
    except InputError:
        return None
    return found if found is not None and found.active else None
