"""Where a difference between two records is largest: in time, in the cycle, in the states and in frequency."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.compare.pair import Pair, harmonic_columns

Array = NDArray[np.float64]
HARMONICS = 6  # harmonics of the forcing that are listed, and removed before the coherence with the command is computed
LOUD = 4.0  # ratio to the noise's variance from which the motions count as different
PHASES, CELLS = 24, 6  # intervals of a cycle; cells along position and along velocity
SMOOTHED = 4  # bins on either side over which the coherence is averaged


@dataclass(frozen=True)
class Place:
    """Where the difference is largest. Shares are of its power; None where unknown.

    `first` and `strongest` [s] are on the recording's clock. `growth` compares the last quarter with the first: ratio of the power
    relative to the motion's. `phase` [cycles after the forcing's peak] has its share in the quarter cycle around it. `position` and
    `velocity` are those of the worst cell. `frequency` [Hz] has its share, the `harmonic` of the forcing there, and the
    `coherence` with the command there.
    """

    first: float | None
    strongest: float
    growth: float
    phase: float | None
    phase_share: float | None
    position: float
    velocity: float
    frequency: float
    frequency_share: float
    harmonic: int | None
    coherence: float | None


def place_of(pair: Pair, difference: Array) -> Place:
    """Locate the largest part of a difference (n,)."""
    square = np.where(pair.used, difference**2, 0.0)
    width = max(1, round(1.0 / (pair.frequency * pair.step)))
    local = np.convolve(square, np.ones(width) / width, mode="same")
    level = max(LOUD * pair.noise**2, 0.1 * float(np.mean(square)))
    loud = np.flatnonzero(local > level)
    quarter = max(1, len(square) // 4)
    share = [
        float(np.mean(square[part]) / max(np.var(pair.recording[part]), 1e-300))
        for part in (slice(quarter), slice(-quarter, None))
    ]
    growth = share[1] / max(share[0], 1e-300)
    phase, phase_share = None, None
    if pair.phase is not None:
        sums = np.bincount((pair.phase * PHASES).astype(int) % PHASES, square, PHASES)
        around = np.array(
            [
                np.take(sums, range(i - PHASES // 8, i + PHASES // 8 + 1), mode="wrap").sum()
                for i in range(PHASES)
            ]
        )
        phase = (int(np.argmax(around)) + 0.5) / PHASES
        phase_share = float(around.max() / max(sums.sum(), 1e-300))
    x, v = pair.recording, pair.velocity
    edges = [np.linspace(float(np.quantile(q, 0.01)), float(np.quantile(q, 0.99)), CELLS + 1) for q in (x, v)]
    weight = np.histogram2d(x, v, edges, weights=square)[0]
    count = np.histogram2d(x, v, edges)[0]
    mean = np.where(count > 0.005 * len(x), weight / np.maximum(count, 1), 0.0)
    i, j = np.unravel_index(int(np.argmax(mean)), mean.shape)
    middle = [0.5 * (e[:-1] + e[1:]) for e in edges]
    frequency, share, harmonic, coherence = _strongest(pair, difference)
    return Place(
        float(pair.time[loud[0]]) if len(loud) else None, float(pair.time[int(np.argmax(local))]), growth, phase, phase_share,
        float(middle[0][i]), float(middle[1][j]), frequency, share, harmonic, coherence,
    )  # fmt: skip


def _strongest(pair: Pair, difference: Array) -> tuple[float, float, int | None, float | None]:
    """Strongest frequency of the difference [Hz], its share, and there the forcing's harmonic and the coherence with the command."""
    n = len(difference)
    window = np.hanning(n)
    power = np.abs(np.fft.rfft((difference - difference.mean()) * window)) ** 2
    power[0] = 0.0
    peak = int(np.argmax(power))
    frequency = peak / (n * pair.step)
    share = float(power[max(0, peak - 2) : peak + 3].sum() / max(power.sum(), 1e-300))
    harmonic = None
    if pair.pumping is not None:
        number = round(frequency / pair.pumping)
        if number >= 1 and abs(frequency - number * pair.pumping) < 1.5 / (n * pair.step):
            harmonic = number
    return frequency, share, harmonic, _follows_command(pair, difference, peak)


def _follows_command(pair: Pair, difference: Array, peak: int) -> float | None:
    """Coherence of the difference with the oscillator's response to the command around bin `peak`.

    The forcing's harmonics are removed first. 1 means that the difference is a filtered version of this response.
    """
    if pair.command is None or np.ptp(pair.command) == 0.0:
        return None
    rest = difference
    if pair.pumping is not None:
        columns = harmonic_columns(pair.time, pair.pumping, HARMONICS)
        rest = difference - columns @ np.linalg.lstsq(columns, difference, rcond=1e-10)[0]
    window = np.hanning(len(rest))
    one = np.fft.rfft(rest * window)
    other = np.fft.rfft(pair.oscillator.response(pair.command, pair.step) * window)
    near = slice(max(1, peak - SMOOTHED), peak + SMOOTHED + 1)
    energy = float(np.sum(np.abs(one[near]) ** 2) * np.sum(np.abs(other[near]) ** 2))
    return float(np.abs(np.sum(one[near] * np.conj(other[near]))) ** 2 / energy) if energy > 0.0 else None
