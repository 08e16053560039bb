"""Spectral lines over position: wavelengths of effects that repeat along the travel, such as a motor's cogging."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

Array = NDArray[np.float64]
FEWEST_WAVES = 2.0  # least number of waves in the travel: with fewer it is a smooth law of the position
FINER = 4  # bins per shortest wave
MOST_BINS = 1 << 20
# zero padding, as a multiple of the travel, so that a line covers more than one bin
PADDED = 2
SLOW = 0.25  # quantile of the speed at which a wave must be below the cut-off
LINES = 3  # largest number of lines: poles, slots, one turn


def lines_below(position: Array, velocity: Array, signal: Array, cut_off: float) -> tuple[float, ...]:
    """Wavelengths of the strongest lines of a signal (n,) over position (n,) that lie below `cut_off` [Hz] in the
    slow parts of the motion."""
    shortest = float(np.quantile(np.abs(velocity), SLOW)) / cut_off
    return strongest_wavelengths(position, signal, shortest, LINES)


def strongest_wavelengths(position: Array, signal: Array, shortest: float, count: int) -> tuple[float, ...]:
    """Wavelengths of the strongest lines of a signal (n,) over position (n,), the strongest first; at most `count`.

    The visited positions may be distributed in any way. The spectrum is that of the signal's sums in bins of
    position, tapered to the ends of the travel (D. J. Thomson, Proc. IEEE 70 (1982) 1055). Wavelengths below
    `shortest` are not searched.
    """
    low, travel = float(position.min()), float(np.ptp(position))
    if len(position) < 8 or not travel > FEWEST_WAVES * shortest > 0.0:
        return ()
    bins = min(MOST_BINS, 1 << math.ceil(math.log2(FINER * travel / shortest)))
    place = np.minimum(((position - low) * (bins / travel)).astype(np.int64), bins - 1)
    taper = np.hanning(bins + 2)[1:-1]
    sums = np.bincount(place, signal - signal.mean(), bins) * taper
    power = np.abs(np.fft.rfft(sums, PADDED * bins)) ** 2
    waves = np.arange(len(power)) / PADDED  # per travel
    power[(waves < FEWEST_WAVES) | (waves > travel / shortest)] = 0.0
    peaks = find_peaks(power, distance=2 * PADDED)[0]
    best = peaks[np.argsort(-power[peaks], kind="stable")][:count]
    return tuple(float(travel / _top(power, waves, one)) for one in best)


def _top(power: Array, waves: Array, peak: int) -> float:
    """Maximum of a parabola through the logarithms of the power around a peak, in waves per travel."""
    below, top, above = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-300))
    bend = below - 2.0 * top + above
    aside = 0.5 * (below - above) / bend if bend < 0.0 else 0.0
    return float(waves[peak] + aside * (waves[1] - waves[0]))
