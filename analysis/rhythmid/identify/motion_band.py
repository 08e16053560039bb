"""Band of a measured motion: the part of a record that moves, the frequency below which its power lies, and the averaging that follows."""

import math

import numpy as np
from numpy.typing import NDArray

from rhythmid.simulation.signal import fast_length

Array = NDArray[np.float64]
# share of a motion's power after a Hann window (3/8 for a steady motion) below which the motion has died out
ERASED = 0.02
LEAST_PART = 16  # least number of samples for a spectrum
# largest rise of the noise's power from an octave to the one below: coloured noise is taken to be of first order at most, 20 dB a decade
RISE = 4.0
FEWEST = 32  # number of the lowest values of a spectrum up to which the level of the noise is that above them


def moving_part(value: Array) -> Array:
    """The samples (n,) without a final part in which hardly anything moves.

    A Hann window over a motion that dies out at once would leave almost none of it. The samples are halved until
    the window leaves some of the motion's power.
    """
    while len(value) >= 2 * LEAST_PART:
        motion = value - value[len(value) // 2 :].mean()
        power = np.sum(motion**2)
        if power == 0.0 or np.sum((motion * np.hanning(len(motion))) ** 2) > ERASED * power:
            break
        value = value[: len(value) // 2]
    return value


def bandwidth(value: Array, period: float, share: float = 0.9999) -> float:
    """Frequency [Hz] below which `share` of the motion's power lies, without mean and trend."""
    value = moving_part(value)
    n = len(value)
    detrended = value - np.linspace(value[: max(1, n // 50)].mean(), value[-max(1, n // 50) :].mean(), n)
    length = fast_length(n)
    power = np.abs(np.fft.rfft(detrended * np.hanning(n), length)) ** 2
    # the power of noise at a frequency is distributed exponentially: the largest of n values is about log2(n) times their median
    power = np.maximum(power - math.log2(len(power)) * noise_level(power), 0.0)
    total = np.cumsum(power)
    if total[-1] <= 0.0:
        return 0.5 / period
    return float(max(np.searchsorted(total, share * total[-1]), 1) / (length * period))


def noise_level(power: Array) -> Array:
    """Median power (n,) of the measurement noise in a spectrum (n,): octave by octave from the upper half of the band downwards.

    The level of an octave is the median of its values, unless that exceeds the level of the octave above by more than noise does:
    then the octave holds motion.
    """
    level = np.empty(len(power))
    end, found = len(power), math.inf
    while end > FEWEST or found == math.inf:
        octave = slice(end // 2, end)
        found = min(float(np.median(power[octave])), RISE * found)
        level[octave] = found
        end //= 2
    level[:end] = found
    return level


def block_length(value: Array, period: float) -> int:
    """Number of samples to average: at least sixteen averages remain in the shortest period with power."""
    return int(np.clip(np.floor(1.0 / (16.0 * bandwidth(value, period) * period)), 1, 10))
