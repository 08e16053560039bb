"""Noise level from repeats: the difference between two periods of the same excitation is noise.

No missing effect affects this noise estimate. It needs stretches in which command and forcing repeat.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.noise import NoiseModel, estimate_noise
from rhythmid.identify.series import Series
from rhythmid.simulation.signal import FOR_EVER

Array = NDArray[np.float64]
TRANSIENT = 0.4  # first part of each series, as a share, that may not have settled
ENOUGH_DIFFERENCES = 400  # least number of differences for a reported noise level


def _sampled(series: Series, which: str) -> Array | None:
    signal = getattr(series, which)
    if signal is None:
        return None
    centres = series.centres
    inside = np.clip(centres, signal.x[0], min(signal.x[-1], FOR_EVER))
    return np.asarray(signal(inside))


def repeat_length(series: Series) -> int | None:
    """Smallest number of blocks after which command and forcing repeat for at least half of the series; None where
    they do not."""
    signals = [
        s
        for s in (_sampled(series, "command"), _sampled(series, "forcing"))
        if s is not None and np.ptp(s) > 0
    ]
    n = series.blocks
    if not signals or n < 64:
        return None
    likely: set[int] | None = None
    for signal in signals:
        centred = signal - signal.mean()
        spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
        correlation = np.fft.irfft(spectrum)[:n] / np.maximum(np.arange(n, 0, -1), 1)
        good = np.flatnonzero(correlation[: n // 2] > 0.99 * correlation[0])
        likely = set(good.tolist()) if likely is None else likely & set(good.tolist())
    for lag in sorted(likely or ()):
        if lag < 8:
            continue
        if all(np.mean(np.abs(s[lag:] - s[:-lag]) < 1e-4 * np.ptp(s)) > 0.95 for s in signals):
            return lag
    return None


def noise_from_repeats(series: Sequence[Series]) -> NoiseModel | None:
    """Noise model from differences between periods; the first part of each series is left out as transient.

    None where too few periods repeat.
    """
    stretches: list[Array] = []
    for one in series:
        lag = repeat_length(one)
        if lag is None:
            continue
        begin = int(max(TRANSIENT * one.blocks, lag))
        value = one.averaged
        if one.blocks - lag - begin < 64:
            continue
        stretches.append((value[begin + lag :] - value[begin:-lag]) / np.sqrt(2.0))
    if sum(len(s) for s in stretches) < ENOUGH_DIFFERENCES:
        return None
    return estimate_noise(stretches)
