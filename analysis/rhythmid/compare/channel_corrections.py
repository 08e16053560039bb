"""Channel corrections: delays, lags, gains, offsets and drifts of any size, applied to a simulated motion."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from rhythmid.compare.pair import Pair

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Correction:
    """An effect on a channel, input or output, with its one parameter."""

    name: str
    slot: str
    parameter: str
    neutral: float
    kind: str  # time, lag, gain, length, rate or skew: determines the unit and the search


CORRECTIONS = (
    Correction("sensor_offset", "sensor", "offset", 0.0, "length"),
    Correction("measurement_delay", "sensor", "delay", 0.0, "time"),
    Correction("input_delay", "command", "delay", 0.0, "time"),
    Correction("sensor_gain", "sensor", "gain", 1.0, "gain"),
    Correction("actuator_gain", "actuator", "gain", 1.0, "gain"),
    Correction("command_gain", "command", "gain", 1.0, "gain"),
    Correction("sensor_drift", "sensor", "rate", 0.0, "rate"),
    Correction("clock_skew", "timing", "skew", 0.0, "skew"),
    Correction("sensor_lag", "sensor", "time_constant", 0.0, "lag"),
    Correction("command_lag", "command", "time_constant", 0.0, "lag"),
)
ALIKE = {  # corrections that are observationally equivalent
    "sensor_drift": ("a slow force",),
    "measurement_delay": ("a delay of forcing and command together",),
    "sensor_lag": ("actuator_lag",),
    "sensor_offset": ("constant_force",),
    "actuator_gain": ("a mass or stiffness that is wrong",),
}


def predicted(pair: Pair, values: Mapping[str, float]) -> Array:
    """The simulated motion (n,) after corrections of the channels, given by the names of `CORRECTIONS`."""
    n = len(pair.time)
    mean = float(np.mean(pair.simulation))
    base = pair.cycle if pair.cycle is not None else np.full(n, mean)
    answer = pair.simulation - base  # response to the command
    answer = late_by(
        _lagged(answer, values.get("command_lag", 0.0), pair.step), values.get("input_delay", 0.0), pair
    )
    motion = base + values.get("command_gain", 1.0) * answer
    motion = mean + values.get("actuator_gain", 1.0) * (motion - mean)
    motion = _lagged(motion, values.get("sensor_lag", 0.0), pair.step)
    skew = values.get("clock_skew", 0.0)
    motion = late_by(motion, values.get("measurement_delay", 0.0) + skew * (pair.time - pair.time[0]), pair)
    drift = values.get("sensor_drift", 0.0) * (pair.time - pair.time[0])
    return values.get("sensor_gain", 1.0) * motion + values.get("sensor_offset", 0.0) + drift


def late_by(signal: Array, delay: Array | float, pair: Pair) -> Array:
    """The signal (n,) delayed by `delay` [s]."""
    if not np.any(delay):
        return signal
    asked = np.clip(pair.time - delay, pair.time[0], pair.time[-1])
    return np.asarray(CubicSpline(pair.time, signal)(asked))


def _lagged(signal: Array, constant: float, step: float) -> Array:
    """First-order lag of a signal that is linear between its samples, at rest before the first."""
    if constant < 1e-3 * step:
        return signal
    keep = math.exp(-step / constant)
    share = constant / step * (1.0 - keep)
    begin = float(signal[0])
    return begin + np.asarray(lfilter([1.0 - share, share - keep], [1.0, -keep], signal - begin))
