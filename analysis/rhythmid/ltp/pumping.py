"""Pumping: the periodic forcing f0(t) that keeps the machine on its limit cycle, and whose phase is the time reference.

All harmonic transfer functions are stated in *cycle time*, which is zero where the fundamental of f0 has phase zero, so
they do not depend on when the recording began.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from rhythmid.errors import InputError
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import spline

Array = NDArray[np.float64]
HARMONICS = 9  # of the forcing that are looked for
HARMONIC = 1e-3  # share of a forcing that its best period may leave before multiples of that period are tried
GRID = 1024  # knots a period of the forcing as a signal; a cubic spline then follows a sinusoid to 1e-12


@dataclass(frozen=True, eq=False)
class Pumping:
    """Periodic forcing f0(t) = Re Σ_h F_h exp(j h ω_p (t − origin)), h = 0, 1, …, in the record's time t [s].

    `coefficients` complex128[H + 1] [N] with F_1 real and not negative by choice of the `origin` [s]. `frequency` [Hz]
    is 1/T; `source` says where this is known from. Where there is no forcing all coefficients are zero.
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


def _projection(
    time: Array, value: Array, frequency: float, harmonics: int
) -> tuple[NDArray[np.complex128], Array]:
    """Least-squares Fourier coefficients F_0 … F_H of `value` in time, and what they leave (n,)."""
    angle = np.multiply.outer(2 * np.pi * frequency * time, np.arange(1, harmonics + 1))
    columns = np.hstack([np.ones((len(time), 1)), np.cos(angle), np.sin(angle)])
    solution = np.linalg.lstsq(columns, value, rcond=1e-10)[0]
    coefficients = np.concatenate(
        [[solution[0] + 0j], solution[1 : harmonics + 1] - 1j * solution[harmonics + 1 :]]
    )
    return coefficients, value - columns @ solution


def fundamental_frequency(time: Array, value: Array) -> float:
    """Frequency [Hz] of a periodic signal (n,) sampled at increasing times [s]: strongest line, refined to full
    precision by the drift of its phase."""
    n = len(time)
    span = time[-1] - time[0]
    even = np.linspace(time[0], time[-1], n)
    grid = np.interp(even, time, value)
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft((grid - np.average(grid, weights=window)) * window, 4 * n))
    line = int(np.argmax(spectrum)) * (n - 1) / (span * 4 * n)
    frequency, left = _refined(time - time.mean(), value, line)
    for divisor in (2, 3):  # the strongest line may be a harmonic: then a multiple of its period leaves less
        if left > HARMONIC * np.std(value) and line * span > 1.5 * divisor:
            lower, rest = _refined(time - time.mean(), value, line / divisor)
            if rest < 0.7 * left and lower * span > 1.0:
                frequency, left = lower, rest
    return frequency


def _refined(time: Array, value: Array, frequency: float) -> tuple[float, float]:
    """The frequency of a Fourier series near `frequency`, first with one harmonic; and the rms of what it leaves."""
    rate = (len(time) - 1) / (time[-1] - time[0])
    left = 0.0
    for harmonics in (1, int(np.clip(0.25 * rate / frequency, 1, HARMONICS))):
        frequency, left = _fourier_fit(time, value, frequency, harmonics)
    return frequency, left


def _fourier_fit(time: Array, value: Array, frequency: float, harmonics: int) -> tuple[float, float]:
    """Gauss-Newton on the frequency of a Fourier series with so many harmonics; and the rms of what it leaves.

    It ends where a step leaves the line that it began on, as it does where there is none.
    """
    left, begin = 0.0, frequency
    near = min(1.0 / (time[-1] - time[0]), 0.5 * begin)
    h = np.arange(1, harmonics + 1)
    columns = np.ones((2 * harmonics + 2, len(time)))
    for _ in range(8):
        turn = np.exp(2j * np.pi * frequency * time)
        power = np.ones(len(time), dtype=complex)
        for n in range(1, harmonics + 1):
            power = power * turn
            columns[n], columns[harmonics + n] = np.real(power), np.imag(power)
        fourier = columns[:-1]
        solution = np.linalg.solve(fourier @ fourier.T, fourier @ value)
        left = float(np.sqrt(np.mean((value - solution @ fourier) ** 2)))
        a, b = solution[1 : harmonics + 1], solution[harmonics + 1 :]
        columns[-1] = (
            2 * np.pi * time * ((h * b) @ fourier[1 : harmonics + 1] - (h * a) @ fourier[harmonics + 1 :])
        )
        size = np.sqrt(np.sum(columns**2, axis=1))
        scaled = columns / size[:, None]
        step = float(np.linalg.solve(scaled @ scaled.T, scaled @ value)[-1] / size[-1])
        if not abs(frequency + step - begin) < near:
            break
        frequency += step
        if abs(step) < 1e-13 * frequency:
            break
    return frequency, left


def pumping_of_channel(channel: Channel, source: str = "forcing channel") -> Pumping:
    """The pumping that a recorded forcing shows. Raises InputError when it is not periodic or covers < 2 periods."""
    time, value = channel.time, channel.value
    if np.ptp(value) == 0.0:
        return Pumping(1.0, np.zeros(2, dtype=complex), 0.0, f"{source} (constant)")
    thin = max(1, len(time) // 60000)  # a forcing is far oversampled
    frequency = fundamental_frequency(time[::thin], value[::thin])
    if frequency * (time[-1] - time[0]) < 2.0:
        raise InputError(
            f"the forcing covers {frequency * (time[-1] - time[0]):.2g} periods; at least 2 are needed to know its phase"
        )
    rate = (len(time) - 1) / (time[-1] - time[0])
    count = int(np.clip(0.25 * rate / frequency, 1, HARMONICS))
    coefficients, rest = _projection(time[::thin], value[::thin], frequency, count)
    if np.std(rest) > 0.05 * np.std(value):
        raise InputError(
            f"the forcing is not periodic: its best period of {1 / frequency:.6g} s leaves "
            f"{np.std(rest) / np.std(value):.0%} of it; check which channel is the forcing"
        )
    coefficients[np.abs(coefficients) < 1e-9 * np.abs(coefficients).max()] = 0.0
    origin = -np.angle(coefficients[1]) / (2 * np.pi * frequency)
    turned = coefficients * np.exp(2j * np.pi * frequency * origin * np.arange(count + 1))
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
