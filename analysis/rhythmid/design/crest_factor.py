"""Crest factor of a multisine, and phases that minimise it, so that a given peak effort carries the most power.

Starts: the phases of M. R. Schroeder, IEEE Trans. Information Theory 16 (1970) 85, for a spectrum of any shape, and random ones.
Then time-frequency swapping: clip the signal, keep the resulting phases, restore the amplitudes, repeat
(E. van der Ouderaa, J. Schoukens, J. Renneboog, IEEE Trans. Instrum. Meas. 37 (1988) 145).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rhythmid.simulation.signal import fast_length

Array = NDArray[np.float64]
Lines = NDArray[np.int64]
# grid points in a period of the highest line; the peak between them is underestimated by less than 1 %
OVERSAMPLING = 12
STARTS = 8  # Schroeder's phases and random ones
ROUNDS = 1500  # clipping iterations
WORK = 150_000_000  # limit of the total number of grid points processed; a long period has fewer starts
GENTLEST, HARSHEST = 0.99, 0.80  # clipping level as a share of the peak


def crest_factor(signal: Array) -> float:
    """Largest |u| over the rms of u, shape (n,); √2 for a sine. Infinite for silence."""
    rms = float(np.sqrt(np.mean(signal**2)))
    return float(np.max(np.abs(signal))) / rms if rms > 0.0 else np.inf


def schroeder_phases(weights: Array) -> Array:
    """φ_n = −2π Σ_{l<n} (n − l) p_l [rad] with relative powers p_l of the lines; shapes (n,) -> (n,)."""
    power = weights**2 / np.sum(weights**2)
    before = np.concatenate([[0.0], np.cumsum(power)[:-1]])
    return -2.0 * np.pi * np.cumsum(before)


def one_period(lines: Lines, weights: Array, phases: Array) -> Array:
    """Σ_k a_k cos(2π k t + φ_k) over one period, oversampled."""
    count = fast_length(OVERSAMPLING * int(lines.max()))
    spectrum = np.zeros(count // 2 + 1, dtype=complex)
    spectrum[lines] = weights * np.exp(1j * phases)
    return np.fft.irfft(spectrum, count) * count / 2.0


def clipped(lines: Lines, weights: Array, phases: Array, rounds: int = ROUNDS) -> tuple[float, Array]:
    """Smallest crest factor that clipping reaches from these phases [rad] (n,), and its phases [rad] (n,)."""
    found = phases
    best, chosen = np.inf, phases
    for level in np.linspace(HARSHEST, GENTLEST, rounds):
        signal = one_period(lines, weights, found)
        crest = crest_factor(signal)
        if crest < best:
            best, chosen = crest, found
        peak = level * float(np.max(np.abs(signal)))
        found = np.angle(np.fft.rfft(np.clip(signal, -peak, peak))[lines])
    return best, chosen


def least_crest(
    lines: Lines, weights: Array, seed: int = 0, progress: Callable[[str], None] | None = None
) -> tuple[float, Array]:
    """Crest factor and phases [rad] (n,) of the best of several clipped starts; lines (n,) are multiples of 1/period.

    Deterministic for a given `seed`. `weights` (n,) are the lines' relative amplitudes, which are kept.
    """
    rng = np.random.default_rng(seed)
    best, phases = np.inf, np.zeros(len(lines))
    starts = int(np.clip(WORK // (OVERSAMPLING * int(lines.max()) * ROUNDS), 1, STARTS))
    for start in range(starts):
        first = schroeder_phases(weights) if start == 0 else rng.uniform(0.0, 2.0 * np.pi, len(lines))
        crest, found = clipped(lines, weights, first)
        if crest < best:
            best, phases = crest, found
        if progress is not None:
            progress(f"minimising the crest factor: {best:.3f}, start {start + 1} of {starts}")
    return best, phases
