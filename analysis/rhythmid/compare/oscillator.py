"""A linear oscillator fitted to a simulated motion: the response of a machine to small forces, without a model of it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.simulation.signal import fast_length

Array = NDArray[np.float64]
FEWEST_FREQUENCIES = 8  # minimum number of frequencies in a force; a single line takes three


@dataclass(frozen=True)
class Oscillator:
    """x'' + damping x' + omega² x = gain · force, with omega [rad/s] and damping [1/s]: the response to small forces."""

    omega: float
    damping: float
    gain: float = 1.0

    def response(self, forces: Array, step: float) -> Array:
        """Motion (n, …) from rest under forces (n, …)."""
        n = len(forces)
        size = fast_length(2 * n)
        s = 2j * np.pi * np.arange(size // 2 + 1) / (size * step)
        transfer = self.gain / (s * s + self.damping * s + self.omega**2)
        shape = (-1,) + (1,) * (forces.ndim - 1)
        return np.asarray(
            np.fft.irfft(transfer.reshape(shape) * np.fft.rfft(forces, size, axis=0), size, axis=0)
        )[:n]

    def free(self, time: Array) -> Array:
        """Responses to two unknown initial conditions, (n, 2)."""
        t = time - time[0]
        turned = 1j * math.sqrt(max(self.omega**2 - 0.25 * self.damping**2, 0.01 * self.omega**2))
        wave = np.exp((turned - 0.5 * self.damping) * t)
        return np.column_stack([wave.real, wave.imag])


def oscillator_of(
    effort: Array, motion: Array, step: float, dominant: float, bandwidth: float
) -> Oscillator | None:
    """Oscillator that maps a force (n,) to a motion (n,), both with step `step` [s], fitted below `bandwidth` [Hz].

    Iterated weighted least squares over frequency (C. K. Sanathanan, J. Koerner, IEEE Trans. Autom. Control 8 (1963) 56). A delay
    of up to half a period of the `dominant` motion [Hz] is found by trial. None where the force contains too few frequencies.
    """
    n = len(motion)
    window = np.hanning(n)
    force = np.fft.rfft((effort - effort.mean()) * window)
    answer = np.fft.rfft((motion - motion.mean()) * window)
    frequency = np.arange(len(force)) / (n * step)
    kept = (frequency > 1.5 / (n * step)) & (frequency < bandwidth)
    if np.sum(np.abs(force) > 1e-2 * np.abs(force).max()) < FEWEST_FREQUENCIES:
        return None
    kept &= np.abs(force) > 1e-3 * np.abs(force).max()
    if kept.sum() < FEWEST_FREQUENCIES:
        return None
    s, force, answer = 2j * np.pi * frequency[kept], force[kept], answer[kept]
    best, least = None, math.inf
    for delay in np.linspace(0.0, 0.5 / dominant, 26):
        late = answer * np.exp(s * delay)
        weight, m, c, k = np.ones(len(s)), 1.0, 0.0, 1.0
        for _ in range(6):
            columns = np.column_stack([s * s * late, s * late, late]) * weight[:, None]
            target = force * weight
            solution = np.linalg.lstsq(
                np.vstack([columns.real, columns.imag]),
                np.concatenate([target.real, target.imag]),
                rcond=None,
            )[0]
            m, c, k = solution
            weight = 1.0 / np.maximum(np.abs(m * s * s + c * s + k), 1e-300)
        left = float(np.sum(np.abs(force / (m * s * s + c * s + k) - late) ** 2))
        if left < least and m > 0.0 and k > 0.0:
            best, least = Oscillator(math.sqrt(k / m), max(c / m, 0.01 * math.sqrt(k / m)), 1.0 / m), left
    return best


def ringing(motion: Array, step: float, dominant: float) -> Oscillator | None:
    """Oscillator of a free motion (n,) around its `dominant` frequency [Hz]; None where the motion does not ring down.

    The motion is regressed on its values a quarter and half a period earlier.
    """
    lag = max(1, round(0.25 / (dominant * step)))
    if len(motion) < 4 * lag:
        return None
    y = motion - motion.mean()
    columns = np.column_stack([y[lag:-lag], y[: -2 * lag], np.ones(len(y) - 2 * lag)])
    first, second, _ = np.linalg.lstsq(columns, y[2 * lag :], rcond=None)[0]
    root = complex(np.roots([1.0, -first, -second])[0])
    if not 0.0 < abs(root) < 1.0 or abs(root.imag) < 1e-3:
        return None
    decay, turn = -math.log(abs(root)) / (lag * step), abs(math.atan2(root.imag, root.real)) / (lag * step)
    return Oscillator(math.hypot(turn, decay), 2.0 * decay)
