"""HTFs from an excitation that separates the harmonics: each is read from the bins that it alone reaches, Ĥ_m = Y_l
/ U_{l−mP}.

There is no smoothing, so a resonance causes no bias. The record's empty bins show the error: noise in bins off the
lattice of lines, distortion of either parity where only that falls, higher harmonics where only those reach.
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.ltp.error_levels import MANY, error_levels, power_beyond
from rhythmid.ltp.excited_lines import ExcitedLines
from rhythmid.ltp.harmonic_estimate import HarmonicEstimate

Array = NDArray[np.float64]
SEPARATED = 0.8  # share of a harmonic's bins that no other harmonic reaches
MOST_SEPARATED_HARMONICS = 8  # largest M


def highest_separated(lines: ExcitedLines, highest: int = MOST_SEPARATED_HARMONICS) -> int | None:
    """Largest M whose harmonics this excitation separates, with empty bins left to measure the error; None if there
    is none."""
    least = 1 if lines.periods else 0
    for harmonics in range(min(highest, lines.farthest), least - 1, -1):
        left = lines.empty(harmonics).sum() + lines.quiet.sum()
        if left >= MANY and lines.separation(harmonics) >= SEPARATED:
            return harmonics
    return None


def read_off(lines: ExcitedLines, harmonics: int) -> tuple[HarmonicEstimate, ...]:
    """H_m for m = −M … M (`harmonics`) from the bins that each alone reaches."""
    found = error_levels(lines, harmonics)
    beyond = power_beyond(lines, harmonics)
    resolution = lines.spectra.resolution
    made = []
    for m in range(-harmonics, harmonics + 1):
        bins = np.flatnonzero(lines.alone(m, harmonics))
        source = lines.spectra.shifted_input(np.array([m]), bins)[0]
        size = np.abs(source)
        noise = np.sqrt(found.noise.power[bins]) / size
        even, odd = np.sqrt(found.even[bins]) / size, np.sqrt(found.odd[bins]) / size
        aliasing = np.sqrt(found.higher[bins] * beyond[bins]) / size
        # with odd lines, even distortion never falls into bins that are used
        std = np.sqrt(noise**2 + np.nan_to_num(odd) ** 2 + aliasing**2)
        frequency: Array = bins.astype(float) * resolution
        made.append(
            HarmonicEstimate(
                m, frequency, lines.spectra.output[bins] / source, std, found.noise.freedom[bins], noise, even,
                odd, aliasing,
            )
        )  # fmt: skip
    return tuple(made)
