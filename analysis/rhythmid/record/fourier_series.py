"""Fourier series of a periodic recorded signal, with the period estimated from the signal."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError

Array = NDArray[np.float64]
HARMONICS = 9  # number of harmonics that are fitted
HARMONIC = 1e-3  # residual share at the best period above which multiples of that period are tried
ENOUGH_SAMPLES = 60_000  # samples that are enough of a signal that is far oversampled
# least number of periods in the signal for its period and phase to be identifiable
LEAST_PERIODS_COVERED = 2.0


@dataclass(frozen=True, eq=False)
class FourierSeries:
    """Re Σ_h F_h exp(j 2π h f t), h = 0 … H, in the signal's own time t [s], with the residual of the signal.

    `frequency` f [Hz]; `coefficients` complex128[H + 1] and the rms residual `left`, in the signal's unit.
    """

    frequency: float
    coefficients: NDArray[np.complex128]
    left: float

    def __call__(self, time: Array) -> Array:
        """Values at times (n,) [s]."""
        h = np.arange(len(self.coefficients))
        return np.real(np.exp(np.multiply.outer(2j * np.pi * self.frequency * time, h)) @ self.coefficients)


def fourier_series(time: Array, value: Array) -> FourierSeries:
    """The Fourier series of a signal (n,) sampled at increasing times [s].

    Raises InputError where the signal is constant or covers less than two periods.
    """
    if np.ptp(value) == 0.0:
        raise InputError("is constant")
    thin = max(1, len(time) // ENOUGH_SAMPLES)
    frequency = fundamental_frequency(time[::thin], value[::thin])
    periods = frequency * (time[-1] - time[0])
    if periods < LEAST_PERIODS_COVERED:
        raise InputError(f"covers {periods:.2g} periods")
    rate = (len(time) - 1) / (time[-1] - time[0])
    count = int(np.clip(0.25 * rate / frequency, 1, HARMONICS))
    coefficients, rest = _projection(time[::thin], value[::thin], frequency, count)
    return FourierSeries(frequency, coefficients, float(np.std(rest)))


def periodic(time: Array, value: Array) -> FourierSeries | None:
    """The Fourier series of a signal (n,); None where it is constant or does not cover two periods."""
    try:
        return fourier_series(time, value)
    except InputError:
        return None


def fundamental_frequency(time: Array, value: Array) -> float:
    """Frequency [Hz] of a periodic signal (n,) sampled at increasing times [s]: its strongest spectral line,
    refined to full precision by the drift of its phase; 0 where no line is stronger than the signal's trend."""
    n = len(time)
    span = time[-1] - time[0]
    even = np.linspace(time[0], time[-1], n)
    grid = np.interp(even, time, value)
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft((grid - np.average(grid, weights=window)) * window, 4 * n))
    line = int(np.argmax(spectrum)) * (n - 1) / (span * 4 * n)
    if line == 0.0:
        return 0.0  # a trend, no oscillation
    frequency, left = _refined(time - time.mean(), value, line)
    # the strongest line may be a harmonic: then a multiple of its period leaves a smaller residual
    for divisor in (2, 3):
        if left > HARMONIC * np.std(value) and line * span > 1.5 * divisor:
            lower, rest = _refined(time - time.mean(), value, line / divisor)
            if rest < 0.7 * left and lower * span > 1.0:
                frequency, left = lower, rest
    return frequency


def _refined(time: Array, value: Array, frequency: float) -> tuple[float, float]:
    """The frequency of a Fourier series near `frequency`, first with one harmonic; and its rms residual."""
    rate = (len(time) - 1) / (time[-1] - time[0])
    left = 0.0
    for harmonics in (1, int(np.clip(0.25 * rate / frequency, 1, HARMONICS))):
        frequency, left = _fourier_fit(time, value, frequency, harmonics)
    return frequency, left


def _fourier_fit(time: Array, value: Array, frequency: float, harmonics: int) -> tuple[float, float]:
    """Gauss-Newton on the frequency of a Fourier series with `harmonics` harmonics; and its rms residual.

    The iteration ends where a step leaves the spectral line on which it started, as it does where there is none. It
    also ends where the samples do not separate the harmonics, for example two stretches with a gap of many periods
    between them.
    """
    left, begin = float(np.std(value)), frequency
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
        try:
            solution = np.linalg.solve(fourier @ fourier.T, fourier @ value)
        except np.linalg.LinAlgError:
            break
        left = float(np.sqrt(np.mean((value - solution @ fourier) ** 2)))
        a, b = solution[1 : harmonics + 1], solution[harmonics + 1 :]
        columns[-1] = (
            2 * np.pi * time * ((h * b) @ fourier[1 : harmonics + 1] - (h * a) @ fourier[harmonics + 1 :])
        )
        size = np.sqrt(np.sum(columns**2, axis=1))
        scaled = columns / size[:, None]
        try:
            step = float(np.linalg.solve(scaled @ scaled.T, scaled @ value)[-1] / size[-1])
        except np.linalg.LinAlgError:
            break
        if not abs(frequency + step - begin) < near:
            break
        frequency += step
        if abs(step) < 1e-13 * frequency:
            break
    return frequency, left


def _projection(
    time: Array, value: Array, frequency: float, harmonics: int
) -> tuple[NDArray[np.complex128], Array]:
    """Least-squares coefficients F_0 … F_H of `value` in time, and the residual (n,)."""
    angle = np.multiply.outer(2 * np.pi * frequency * time, np.arange(1, harmonics + 1))
    columns = np.hstack([np.ones((len(time), 1)), np.cos(angle), np.sin(angle)])
    solution = np.linalg.lstsq(columns, value, rcond=1e-10)[0]
    coefficients = np.concatenate(
        [[solution[0] + 0j], solution[1 : harmonics + 1] - 1j * solution[harmonics + 1 :]]
    )
    return coefficients, value - columns @ solution
