"""Relations between two recorded numbers: integral, copy with a lag, or driver."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import coherence, welch

from rhythmid.record.inventory import Recorded

Array = NDArray[np.float64]
MOST_SAMPLES = 20_000  # largest number of samples used: more add no information
SEGMENTS = 6  # segments of a record for its spectra, overlapping by half
LATEST_ANSWER = 0.5  # [s] largest lag of an answer after its command
LAGS = 12  # past samples in an autoregression
MOST_ROWS = 2000  # largest number of rows of an autoregression: more add no information
PER_PERIOD = 16.0  # samples in the shortest period with power, for an autoregression
POWER = 0.99  # share of the power below the corresponding frequency
# share of a signal's variance below which the residual of an autoregression is rounding error
ROUNDING = 1e-8
GAP = 10.0  # ratio to the median sample period above which a step is a gap without interpolation
MAIN_PART = 0.5  # share of a record that is enough for a stretch without gaps to be used alone
# ratio to the chance level of a prediction's gain above which it is significant: with 12 lags below 1 in ten million
SURE = 5.0
GOES_ALONG = 0.5  # coherence above which two numbers are related
HARDLY = 0.3  # coherence with the output below which a number without a name is no driving signal
# correlation above which a position and a velocity belong together, where no name says so
SURE_INTEGRAL = 0.98
RATIO = 0.3  # relative difference of a position's slope and the velocity above which the units are doubted
# share of the greatest correlation over all signs and lags: an answer with a slightly early clock has this, too
NEARLY = 0.8
TIME_UNITS = (1.0, 1e3, 1e6, 1e9)  # units of a clock per second: s, ms, us, ns
# relative difference of a clock's rate from that of the stamps: oscillators differ far less, jittering stamps of a
# short record about as much
PACE = 0.01
SAME_SIZE = (0.5, 2.0)  # ratio of sizes within which an answer has the size of its command


@dataclass(frozen=True)
class Follows:
    """How well `answer` is a later copy of `command`: correlation, lag [s] and the ratio of sizes. `later` is the
    greatest correlation with the same sign and a nonnegative lag, 0 where there is none."""

    correlation: float
    lag: float
    ratio: float
    later: float = 0.0

    @property
    def is_copy(self) -> bool:
        """Whether it is the same quantity, in the same unit."""
        return SAME_SIZE[0] < self.ratio < SAME_SIZE[1]

    @property
    def is_answer(self) -> bool:
        """Whether the answer may follow the command: with the same sign and not earlier. With a single sine either
        may follow the other."""
        return self.later > 0.0 and self.later >= NEARLY * abs(self.correlation)


def together(first: Recorded, second: Recorded) -> tuple[float, Array, Array]:
    """Both on a common grid by linear interpolation: period [s], and values (n,) each; n is 0 where they do not overlap.

    Where a stretch without gaps covers most of the time, only that stretch is used: interpolation across a gap is
    no motion.
    """
    (begin, end), (other_begin, other_end) = _main_part(first), _main_part(second)
    begin, end = max(begin, other_begin), min(end, other_end)
    rate = min(first.rate, second.rate)
    count = int((end - begin) * rate) if rate > 0.0 else 0
    if count < 4 * LAGS:
        return 1.0, np.empty(0), np.empty(0)
    grid = begin + np.arange(min(count, MOST_SAMPLES)) / rate
    return 1.0 / rate, np.interp(grid, *_finite(first)), np.interp(grid, *_finite(second))


def runs_like_a_clock(one: Recorded) -> bool:
    """Whether a number never decreases, and increases with the times of its samples like a clock in s, ms, us or ns."""
    time, value = _finite(one)
    if len(value) < 4 * LAGS or (np.diff(value) < 0.0).any() or np.ptp(time) == 0.0 or np.ptp(value) == 0.0:
        return False
    time, value = time - time.mean(), value - value.mean()
    pace = float(time @ value / (time @ time))
    straight = 1.0 - float(np.sum((value - pace * time) ** 2) / (value @ value)) >= (1.0 - PACE) ** 2
    return straight and any(abs(pace / unit - 1.0) <= PACE for unit in TIME_UNITS)


def _main_part(one: Recorded) -> tuple[float, float]:
    """Start and end [s] of the longest stretch without gaps where that is most of the record, else of the record."""
    begin, end = float(one.time[0]), float(one.time[-1])
    step = np.diff(one.time)
    usual = float(np.median(step)) if len(step) else 0.0
    gaps = np.flatnonzero(step > GAP * usual)
    starts, ends = np.append(begin, one.time[gaps + 1]), np.append(one.time[gaps], end)
    longest = int(np.argmax(ends - starts))
    if usual > 0.0 and ends[longest] - starts[longest] >= MAIN_PART * (end - begin):
        return float(starts[longest]), float(ends[longest])
    return begin, end


def _finite(one: Recorded) -> tuple[Array, Array]:
    kept = np.isfinite(one.value)
    return one.time[kept], one.value[kept]


def derivative(position: Recorded, velocity: Recorded) -> tuple[float, float]:
    """Correlation of the slope of `position` with `velocity`, and the ratio of slope to velocity; 0, 0 where they
    cannot be computed.

    The integral of the velocity is compared, to avoid differentiation of noise; linear trends are removed from both.
    """
    period, x, v = together(position, velocity)
    if not len(x):
        return 0.0, 0.0
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1])) * period])
    time = np.linspace(-1.0, 1.0, len(x))
    base = np.column_stack([np.ones(len(x)), time])
    x, integral = (one - base @ np.linalg.lstsq(base, one, rcond=None)[0] for one in (x, integral))
    power = float(integral @ integral)
    if power == 0.0 or not x.any():
        return 0.0, 0.0
    return float(x @ integral / math.sqrt(power * float(x @ x))), float(x @ integral / power)


def integrals(able: Sequence[Recorded]) -> list[tuple[Recorded, Recorded, float]]:
    """Pairs of numbers of which one is clearly the integral of the other, in consistent units, with their
    correlation. Slopes of other numbers among them are left out, because their own slopes are accelerations."""
    found: list[tuple[Recorded, Recorded, float]] = []
    for first in able:
        for second in able:
            if first is second:
                continue
            r, ratio = derivative(first, second)
            if r > SURE_INTEGRAL and abs(ratio - 1.0) < RATIO:
                found.append((first, second, r))
    slopes = {id(second) for _, second, _ in found}
    return [pair for pair in found if id(pair[0]) not in slopes] or found


def follows(command: Recorded, answer: Recorded) -> Follows:
    """The correlation of an answer with its command at the lag of its maximum, which may be negative."""
    period, u, y = together(command, answer)
    if not len(u) or np.ptp(u) == 0.0 or np.ptp(y) == 0.0:
        return Follows(0.0, 0.0, 0.0)
    u, y = u - u.mean(), y - y.mean()
    length = 1 << (2 * len(u) - 1).bit_length()
    product = np.fft.irfft(np.fft.rfft(y, length) * np.conj(np.fft.rfft(u, length)), length)
    most = min(int(LATEST_ANSWER / period), len(u) // 4)
    lags = np.concatenate([np.arange(most + 1), np.arange(-most, 0)])
    strongest = int(lags[int(np.argmax(np.abs(product[lags])))])
    best = _peak(u, y, strongest, most)
    size = math.sqrt(float(u @ u) * float(y @ y))
    later = max(float(product[: most + 1].max()) / size, 0.0)
    return Follows(float(product[strongest]) / size, best * period, float(np.std(y) / np.std(u)), later)


def _peak(u: Array, y: Array, lag: int, most: int) -> int:
    """The lag [samples] of the nearest maximum of the correlation over the samples that both have at it. The product of
    the whole records favours small lags, which have more samples in common."""

    def alike(lag: int) -> float:
        early, late = (u[: len(u) - lag], y[lag:]) if lag >= 0 else (u[-lag:], y[: len(y) + lag])
        size = float(np.std(early) * np.std(late))
        return (
            abs(float(np.mean((early - early.mean()) * (late - late.mean())))) / size if size > 0.0 else 0.0
        )

    best, value = lag, alike(lag)
    for step in (1, -1):
        while abs(best + step) <= most and (further := alike(best + step)) > value:
            best, value = best + step, further
    return best


def coherent(first: Recorded, second: Recorded) -> float:
    """Share of the power of `second` that a linear filter of `first` explains: the mean coherence, weighted by that
    power."""
    period, u, y = together(first, second)
    if not len(u) or np.ptp(u) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    length = max(2 * LAGS, len(u) // SEGMENTS)
    u, y = np.diff(u), np.diff(y)  # slow drifts are correlated by chance
    with np.errstate(divide="ignore", invalid="ignore"):  # at frequencies without power
        _, share = coherence(u, y, 1.0 / period, nperseg=length)
    _, power = welch(y, 1.0 / period, nperseg=length)
    told = np.isfinite(share)
    return float(np.sum(share[told] * power[told]) / np.sum(power))


def drives(cause: Recorded, effect: Recorded) -> float:
    """How much better the past of both predicts `effect` than its own past alone, as a log ratio of variances.

    C. W. J. Granger, Econometrica 37 (1969) 424: a cause helps to predict its effect. Large where `cause` drives
    `effect`, near 0 where it does not.
    """
    return _gain(cause, effect)[0]


def predicts(cause: Recorded, effect: Recorded) -> float:
    """Gain by which the past of `cause` helps to predict `effect`, relative to chance: about 1 where it does not help.

    By chance, the gain in log variance times the number of rows is chi-squared with as many degrees of freedom as
    there are lags.
    """
    gain, rows = _gain(cause, effect)
    return gain * rows / LAGS


def lead(cause: Recorded, effect: Recorded) -> tuple[float, float]:
    """Lead [s] of one number over the other, as far as it is shorter than its periods, and its standard error [s].

    `cause` is fitted by k times `effect` plus d times its rate; the lead is d/k. The driving force of a machine
    with stiffness k and damping d leads its motion by that much; a filter's output lags its input. The standard
    error is that of the spread between parts of the record.
    """
    period, u, y = together(cause, effect)
    parts = [
        _lead_of(*part, period) for part in zip(np.array_split(u, SEGMENTS), np.array_split(y, SEGMENTS))
    ]
    found = np.array([one for one in parts if one is not None])
    if len(found) < 2:
        return 0.0, math.inf
    return float(found.mean()), float(found.std(ddof=1) / math.sqrt(len(found)))


def _lead_of(u: Array, y: Array, period: float) -> float | None:
    """Ratio [s] of the rate's to the value's coefficient in the fit of `u` by `y`; None where there is none."""
    if len(u) < LAGS or np.ptp(y) == 0.0:
        return None
    rate = (y[2:] - y[:-2]) / (2.0 * period)
    columns = np.column_stack([y[1:-1], rate, np.ones(len(rate))])
    k, d, _ = np.linalg.lstsq(columns, u[1:-1], rcond=1e-10)[0]
    return float(d / k) if k else None


def goes_along(one: Recorded, other: Recorded) -> bool:
    """Whether a channel is clearly related to another one: by coherence, or because it helps to predict it."""
    return coherent(one, other) >= GOES_ALONG or predicts(one, other) >= SURE


def _gain(cause: Recorded, effect: Recorded) -> tuple[float, int]:
    """Gain of a prediction in log variance, and the number of rows used."""
    period, u, y = together(cause, effect)
    if not len(u) or np.ptp(u) == 0.0 or np.ptp(y) == 0.0:
        return 0.0, 0
    step = max(1, int(1.0 / (PER_PERIOD * max(_fastest(u, period), _fastest(y, period)) * period)))
    while len(u) // step < 4 * LAGS and step > 1:
        step //= 2
    u, y = u[::step], y[::step]
    u, y = (u - u.mean()) / np.std(u), (y - y.mean()) / np.std(y)
    past = np.lib.stride_tricks.sliding_window_view
    every = max(1, len(y) // MOST_ROWS)
    own, other, target = past(y[:-1], LAGS)[::every], past(u[:-1], LAGS)[::every], y[LAGS:][::every]
    alone = _left(own, target)
    both = _left(np.hstack([own, other]), target)
    return math.log((alone + ROUNDING) / (both + ROUNDING)), len(target)


def _left(columns: Array, target: Array) -> float:
    solution = np.linalg.lstsq(columns, target, rcond=1e-10)[0]
    return float(np.mean((target - columns @ solution) ** 2))


def _fastest(value: Array, period: float) -> float:
    """Frequency [Hz] below which most of a signal's power lies."""
    power = np.abs(np.fft.rfft((value - value.mean()) * np.hanning(len(value)))) ** 2
    total = np.cumsum(power)
    place = int(np.searchsorted(total, POWER * total[-1])) if total[-1] > 0.0 else 1
    return max(place, 1) / (len(value) * period)
