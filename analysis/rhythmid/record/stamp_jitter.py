"""Jitter of timestamps, estimated from the samples alone: noise between neighbours that grows with the slope of the
signal.

A sample whose timestamp has an error ε is off by ε times the slope s. So the variance of the noise is σ² + j² s²,
with the standard deviation j of the jitter (T. M. Souders et al., IEEE Trans. Instrum. Meas. 39 (1990) 80). The
noise is the deviation of a sample from a polynomial through its neighbours. No model is used, because the error of
an incomplete model grows with speed, too. Times that follow from a declared rate are no timestamps, so no jitter is
estimated for a record without any (`Record.stamped`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.rounding import resolutions
from rhythmid.record.timing import GAP, nominal_period

Array = NDArray[np.float64]
Samples = tuple[Array, Array]  # times [s] and values of one stretch
SIDES = (3, 4)  # neighbours on either side for the polynomial, and for the finer one that must confirm it
AGREE = 1.5  # largest ratio of the two variances: a difference between the polynomials is motion
# in periods; where samples are closer together, a polynomial through them oscillates
SHORTEST_STEP_IN_PERIODS = 0.3
BINS = 16  # by slope, with equal numbers of samples
SAMPLES_OF_A_BIN = 100  # least samples per bin
SLOWER = (
    2 / 3
    # share of slower samples that must also show the jitter: kinks of a motion, such as impacts, occur at the highest speed
)
JITTER_SHOWN = 5.0  # standard deviations above which jitter is detected
SHOWN_BY_SLOWER = 3.0  # the same among the slower samples
# share of a sample period below which jitter is finer than clocks and logged numbers resolve
RESOLVED_JITTER = 1e-3
WORTH_WEIGHING = 0.05  # share of the noise variance at rest below which weights would hardly differ
OUTLYING = 4.0  # robust standard deviations of a bin at which a deviation is clipped
CORRELATED = 4.0  # neighbouring deviations share samples: factor by which their squares count less
NORMAL_MEDIAN = 0.6745  # median absolute value of a standard normal deviate
COARSE = 2.0  # rounding steps between samples; below this, rounding errors are not noise
WIDTHS = (1, 2, 4, 8, 16, 32)  # samples on either side for the slope; the smallest sufficient width is taken
STEADY = 0.02  # largest share of noise in the mean square of the slope


@dataclass(frozen=True)
class StampJitter:
    """Timestamp jitter: its standard deviation `std` [s], the standard deviation of that estimate `uncertainty`
    [s], and the standard deviation `noise` of a sample at rest, in the unit of the signal."""

    std: float
    uncertainty: float
    noise: float

    def relative(self, time: Array, value: Array) -> Array:
        """Standard deviation (n,) of each sample's noise, relative to that at rest."""
        return np.sqrt(1.0 + (self.std * slope_of(time, value, self.noise) / self.noise) ** 2)


def stamp_jitter(stretches: Sequence[Samples]) -> StampJitter | None:
    """Timestamp jitter of one channel, recorded in these stretches; None where none is detected."""
    given = [(t, v) for t, v in stretches if len(t) > 4 * max(SIDES)]
    if sum(len(t) for t, _ in given) < BINS * SAMPLES_OF_A_BIN:
        return None
    period = float(np.median([nominal_period(np.diff(time)) for time, _ in given]))
    steps = resolutions(np.concatenate([value for _, value in given]))
    step = float(steps.max())
    coarse, fine = (_found(given, sides, period, step) for sides in SIDES)
    if coarse is None or fine is None or coarse.std > math.sqrt(AGREE) * fine.std:
        return None
    if np.ptp(steps) > 0.0 and fine.noise <= step:
        return None  # rounding errors of numbers grow with their size, and so do speeds in an oscillation
    return fine


def _found(stretches: Sequence[Samples], sides: int, period: float, step: float) -> StampJitter | None:
    """Jitter estimated with a polynomial through `sides` neighbours on either side."""
    deviations = [_deviations(time, value, sides, period) for time, value in stretches]
    left = np.concatenate([d for d, _ in deviations])
    noise = float(np.median(np.abs(left))) / NORMAL_MEDIAN if len(left) else 0.0
    if noise == 0.0:
        return None
    slopes = [slope_of(time, value, noise)[kept] for (time, value), (_, kept) in zip(stretches, deviations)]
    square = np.concatenate(slopes) ** 2
    if step > 0.0:
        told = square * period**2 > (COARSE * step) ** 2
        left, square = left[told], square[told]
    if len(left) < BINS * SAMPLES_OF_A_BIN:
        return None
    speeds, variances, counts = _binned(left, square)
    whole, slower = _line(speeds, variances, counts), round(SLOWER * BINS)
    part = _line(speeds[:slower], variances[:slower], counts[:slower])
    if whole is None or part is None:
        return None
    (rest, growth, spread), (_, again, doubt) = whole, part
    if growth < JITTER_SHOWN * spread or again < SHOWN_BY_SLOWER * doubt or not 0.5 < again / growth < 2.0:
        return None
    std = math.sqrt(growth)
    if std < RESOLVED_JITTER * period or growth * float(speeds.mean()) < WORTH_WEIGHING * rest:
        return None
    return StampJitter(std, 0.5 * spread / std, math.sqrt(rest))


def _deviations(time: Array, value: Array, sides: int, period: float) -> tuple[Array, NDArray[np.int64]]:
    """Deviations of samples from the polynomial through their neighbours, scaled to the noise of one sample; and
    the samples' indices."""
    n = len(time) - 2 * sides
    offsets = [k for k in range(-sides, sides + 1) if k]
    apart = {k: time[sides + k : sides + k + n] - time[sides : sides + n] for k in offsets}
    told, square = np.zeros(n), np.ones(n)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in offsets:
            weight = np.ones(n)
            for other in offsets:
                if other != k:
                    weight *= apart[other] / (apart[other] - apart[k])
            told += weight * value[sides + k : sides + k + n]
            square += weight**2
    step = np.diff(time)
    even = (step > SHORTEST_STEP_IN_PERIODS * period) & (step < GAP * period)
    kept = np.ones(n, bool)
    for k in range(2 * sides):
        kept &= even[k : k + n]
    places = np.flatnonzero(kept)
    middle = value[sides : sides + n]
    return (middle[kept] - told[kept]) / np.sqrt(square[kept]), places + sides


def slope_of(time: Array, value: Array, noise: float) -> Array:
    """Slope (n,) of a noisy signal: a straight line through the surrounding samples, as few as the noise allows."""
    slope = np.gradient(value, time)
    for width in WIDTHS:
        if len(time) <= 2 * width:
            break
        slope = _line_slope(time, value, width)
        step = nominal_period(np.diff(time))
        variance = 3.0 * noise**2 / (step**2 * width * (width + 1) * (2 * width + 1))
        if variance < STEADY * float(np.mean(slope**2)):
            break
    return slope


def _line_slope(time: Array, value: Array, width: int) -> Array:
    """Slope (n,) of the straight line through each sample and `width` on either side; at the ends, the nearest such
    slope."""
    n = len(time) - 2 * width
    t, v, tt, tv = (np.zeros(n) for _ in range(4))
    for k in range(2 * width + 1):
        apart = time[k : k + n] - time[width : width + n]
        rise = value[k : k + n] - value[width : width + n]
        t, v, tt, tv = t + apart, v + rise, tt + apart * apart, tv + apart * rise
    count = 2 * width + 1
    slope = (tv - t * v / count) / (tt - t * t / count)
    return np.pad(slope, width, mode="edge")


def _binned(left: Array, square: Array) -> tuple[Array, Array, Array]:
    """Mean square of the slope, variance of the deviations and number of samples of each bin, (b,) each, slowest
    first."""
    order = np.argsort(square, kind="stable")
    speeds, variances, counts = [], [], []
    for own in np.array_split(order, BINS):
        limit = OUTLYING * float(np.median(np.abs(left[own]))) / NORMAL_MEDIAN
        speeds.append(float(square[own].mean()))
        variances.append(float(np.mean(np.clip(left[own], -limit, limit) ** 2)))
        counts.append(len(own))
    return np.array(speeds), np.array(variances), np.array(counts, dtype=float)


def _line(speeds: Array, variances: Array, counts: Array) -> tuple[float, float, float] | None:
    """Level and growth of the variance with the square of the slope, and the growth's standard deviation; None
    where it does not grow from a positive level."""
    if not variances.min() > 0.0:
        return None
    size = max(float(speeds.mean()), 1e-300)
    columns = np.column_stack([np.ones(len(speeds)), speeds / size])
    expected = variances
    solution = covariance = None
    for _ in range(4):
        weight = np.sqrt(counts / (2.0 * CORRELATED)) / np.maximum(expected, 1e-300)
        scaled = columns * weight[:, None]
        covariance = np.linalg.pinv(scaled.T @ scaled)
        solution = covariance @ (scaled.T @ (variances * weight))
        expected = np.maximum(columns @ solution, 0.2 * float(variances.min()))
    assert solution is not None and covariance is not None
    if solution[0] <= 0.0 or solution[1] <= 0.0:
        return None
    return float(solution[0]), float(solution[1]) / size, math.sqrt(covariance[1, 1]) / size
