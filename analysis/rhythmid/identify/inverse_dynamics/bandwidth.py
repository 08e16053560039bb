"""Bandwidth of the measured motion, and bandwidth within which the motion explains the effort.

The motion explains what any map of the instantaneous motion makes, and besides what any linear system makes of the
acceleration: a resonance makes a force that is coherent with the motion although no map of the instant shows it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import coherence, csd, detrend, welch

from rhythmid.identify.inverse_dynamics.free_map import FreeMap
from rhythmid.identify.inverse_dynamics.motion import (
    Motion,
    Stretch,
    high_pass,
    low_pass,
    motion_of,
    stretches,
)
from rhythmid.identify.position_lines import lines_below
from rhythmid.model import Model
from rhythmid.record.record import Record

Array = NDArray[np.float64]
# least ratio of the motion's spectrum to its noise floor within the bandwidth (as the records' own `bandwidth`)
ABOVE = 4.0
# share of the sample rate: there the derivatives of a spline have an error of 3 %
HIGHEST_DERIVED_SHARE = 0.2
# share of the effort's power that the motion has to explain, and coherence from which it counts as driving a motion
HALF = 0.5
# share of the effort's power that goes with the motion above the band of the comparison, from which the band is widened or the
# answer says so (measured: at most 0.1 on real machines, 0.4 on excitations that reach the highest measured frequency at full strength)
MUCH = 0.1
WIDER = 2.0  # cut-off of the motion's filter as a multiple of the effort's highest one, which it then leaves as it is
SEGMENTS = 8  # least number of segments of a record in Welch's spectra
RIDGE = 1e-6  # share of the columns' power, as regularisation against collinear columns
FLOORLESS = 1e-12  # share of the strongest line below which an apparent floor is leakage of the window
SLOW = 4.0  # ratio of the strongest frequency to the lowest one from which an acceleration is integrated
# least cut-off as a multiple of the motion's strongest frequency: a lower one would smooth the friction force at
# each reversal
LOWEST = 4.0
# share of the effort's shortest period up to which a gap is bridged: a cubic misses 12 % of a signal of that
# period, 1.5 % at twice the period
QUARTER = 0.25


@dataclass(frozen=True)
class Bandwidth:
    """Cut-offs [Hz] of the motion's filter and of the parallel filter on effort and columns.

    `explained` is the share of the effort's power below `effort` [Hz] that the motion explains, `dominant` [Hz] the
    motion's strongest frequency. Where an acceleration was measured, the motion is unknown below `low` [Hz].
    `left_out` is the share of the effort's power above `effort` that goes with the motion, up to `left_out_to` [Hz].
    `mapped` is the share that a free map alone explains in the band that it explains: whether this effort makes the motion.
    `unexplained` is the mean square of the effort below `effort` [Hz] that the motion does not explain.
    """

    motion: float
    effort: float
    explained: float
    dominant: float
    low: float = 0.0
    left_out: float = 0.0
    left_out_to: float = 0.0
    mapped: float = 1.0
    unexplained: float = 0.0


def bridged(records: Sequence[Record], model: Model) -> tuple[list[Stretch], Bandwidth]:
    """The stretches of these records and their bandwidth. Gaps that are short relative to the effort's shortest
    period are bridged.

    The bandwidth is first estimated from the stretches between all gaps, then again from the resulting longer ones.
    """
    raw = stretches(records, model)
    chosen = bandwidth_of(raw, model)
    longer = stretches(records, model, QUARTER / chosen.effort)
    if not any(one.bridged for one in longer):
        return raw, chosen
    chosen = bandwidth_of(longer, model)
    return stretches(records, model, QUARTER / chosen.effort), chosen


def bandwidth_of_motion(raw: Sequence[Stretch]) -> tuple[float, float]:
    """Highest frequency [Hz] at which the motion of these stretches is measured, and its strongest frequency [Hz]."""
    limits, lines, weights = [], [], []
    for one in raw:
        limit, line = _of_motion(one)
        limits.append(limit)
        lines.append(line)
        weights.append(len(one.time) * one.period)
    motion = float(np.median(limits))
    dominant = float(np.average(lines, weights=weights))
    motion = max(motion, min(2.0 * LOWEST * dominant, HIGHEST_DERIVED_SHARE / max(one.period for one in raw)))
    return motion, dominant


def bandwidth_of(raw: Sequence[Stretch], model: Model) -> Bandwidth:
    """The bandwidth within which the effort of these stretches is explained.

    Half the frequency up to which the motion is measured serves machines whose effort lies below. Where much of it lies above, the
    effort is compared up to that frequency itself; the motion's filter then passes some more of the noise.
    """
    motion, dominant = bandwidth_of_motion(raw)
    low = dominant / SLOW if any(one.measured == "acceleration" for one in raw) else 0.0

    def below(cut: float) -> Bandwidth:
        return bandwidth_below([motion_of(one, model, cut, low) for one in raw], cut, dominant, low)

    found = below(motion)
    wider = min(WIDER * motion, HIGHEST_DERIVED_SHARE / max(one.period for one in raw))
    if found.left_out < MUCH or wider <= motion:
        return found
    return max(below(wider), found, key=lambda one: one.effort)


def bandwidth_below(motions: Sequence[Motion], motion: float, dominant: float, low: float = 0.0) -> Bandwidth:
    """The bandwidth within which the effort of these motions, known below `motion` [Hz], is explained."""
    lines = _lines(motions, motion / WIDER, low)
    least = min(LOWEST * dominant, motion / WIDER)
    by_map, effort = (max(one, least) for one in _of_effort(motions, motion / WIDER, dominant, low, lines))
    mapped, explained, power = _explained(motions, effort, low, lines)
    if by_map != effort:
        mapped, *_ = _explained(motions, by_map, low, lines)
    left_out = _left_out(motions, motion, effort)
    return Bandwidth(motion, effort, explained, dominant, low, *left_out, mapped, (1.0 - explained) * power)


def _of_motion(raw: Stretch) -> tuple[float, float]:
    """Highest frequency [Hz] at which the motion exceeds its noise floor, and its strongest frequency [Hz].

    The spectrum may fall to the floor between two lines. The band includes such a gap where the part of the velocity that is coherent with
    what drives the machine has more power beyond the gap, above `ABOVE` times the floor, than it lacks within. A vibration of the structure
    that nothing recorded drives is no part of it.
    """
    rate = 1.0 / raw.period
    frequency, power, floor = _spectrum(raw)
    length = _segment(raw)
    peak = 1 + int(np.argmax(power[1:]))
    below = np.flatnonzero(power[peak:] < ABOVE * floor)
    last = peak + int(below[0]) if len(below) else len(power) - 1
    if len(below) and np.ptp(raw.drive) > 0.0:
        with np.errstate(divide="ignore", invalid="ignore"):  # where there is no power there is no coherence
            coherent = coherence(raw.output, raw.drive, rate, nperseg=length, detrend="linear")[1] >= HALF
        driven = np.where(coherent, power, 0.0)
        gained = np.cumsum((frequency**2 * (driven - ABOVE * floor))[last:])
        beyond = int(np.argmax(gained))
        last = min(last + beyond + 1, len(power) - 1) if gained[beyond] > 0.0 else last
    if floor < FLOORLESS * float(power.max()):
        last = len(power) - 1
    whole = np.abs(np.fft.rfft(detrend(raw.output) * np.hanning(len(raw.output))))
    strongest = (1 + int(np.argmax(whole[1:]))) * rate / len(raw.output)
    return min(float(frequency[last]), HIGHEST_DERIVED_SHARE * rate), float(strongest)


def _segment(raw: Stretch) -> int:
    """Samples of a segment of the spectra."""
    return max(min(len(raw.output), 64), len(raw.output) // SEGMENTS)


def _spectrum(raw: Stretch) -> tuple[Array, Array, float]:
    """Frequencies (k,) [Hz], power spectral density (k,) of the measured output, and its noise floor."""
    frequency, power = welch(
        raw.output - raw.output.mean(), 1.0 / raw.period, nperseg=_segment(raw), detrend="linear"
    )
    return frequency, power, noise_floor(power)


def noise_floor(power: Array) -> float:
    """The floor of a power spectral density (k,): its median above half of the highest frequency."""
    return float(np.median(power[len(power) // 2 :]))


def noise_of_output(raw: Stretch) -> float:
    """Standard deviation of the white noise of a measured output; 0 where its floor is leakage of the spectrum's window."""
    _, power, floor = _spectrum(raw)
    return math.sqrt(0.5 * floor / raw.period) if floor >= FLOORLESS * float(power.max()) else 0.0


def _lines(motions: Sequence[Motion], frequency: float, low: float) -> tuple[float, ...]:
    """Wavelengths of lines over position in the residuals: a free map is too smooth for a ripple with many periods,
    which would be taken for noise."""
    _, left = _residuals(motions, frequency, low, ())
    kept = [_kept(motion, frequency) for motion in motions]
    position, velocity = (
        np.concatenate([one[part] for one, part in zip(signals, kept, strict=True)])
        for signals in ([m.leg_position for m in motions], [m.leg_velocity for m in motions])
    )
    return lines_below(position, velocity, np.concatenate(left), frequency)


def _kept(motion: Motion, frequency: float) -> slice:
    """Samples of a motion without the filter's transients at both ends."""
    margin = min(math.ceil(1.0 / (frequency * motion.period)), len(motion.time) // 4)
    return slice(margin, len(motion.time) - margin)


def _residuals(
    motions: Sequence[Motion], frequency: float, low: float, lines: Sequence[float]
) -> tuple[list[Array], list[Array]]:
    """Efforts below the frequency, and their residuals after a free map with these lines over position."""
    free = FreeMap(list(motions))

    def below(values: Array, motion: Motion) -> Array:
        passed = low_pass(values, motion.period, frequency)
        return high_pass(passed, motion.period, low)[_kept(motion, frequency)]

    # one motion at a time: the columns of many long records would be large
    efforts: list[Array] = []
    products: list[Array] = []
    for motion in motions:
        both = below(np.column_stack([motion.effort, _columns(free, motion, lines)]), motion)
        efforts.append(both[:, 0].copy())
        products.append(both.T @ both)
    product = np.sum(products, axis=0)
    norms = np.sqrt(np.diag(product)[1:])
    norms[norms == 0.0] = 1.0
    normal = product[1:, 1:] / np.outer(norms, norms) + RIDGE * np.eye(len(norms))
    coefficients = np.linalg.solve(normal, product[1:, 0] / norms) / norms
    # filters are linear, so one pass filters the sum of the columns
    return efforts, [
        effort - below(_columns(free, motion, lines) @ coefficients, motion)
        for effort, motion in zip(efforts, motions, strict=True)
    ]


def _columns(free: FreeMap, motion: Motion, lines: Sequence[float]) -> Array:
    """Regressors (n, q) for the effort of a motion: a free map, the motion itself, lines over position, and what else the body requires.

    The latter is no part of the effort: it is computed from the motion, and above the motion it is the noise of a second derivative, which the
    acceleration would explain.
    """
    made = [free.columns(motion, np.zeros(len(motion.time))), motion.leg_position, motion.leg_velocity]
    if not motion.driven_by_base:
        made.append(motion.acceleration)
    if motion.coupling is not None:
        made.append(motion.coupling)
    turns = [2.0 * math.pi * motion.leg_position / wavelength for wavelength in lines]
    return np.column_stack([*made, *(wave(turn) for turn in turns for wave in (np.cos, np.sin))])


def _of_effort(
    motions: Sequence[Motion], most: float, dominant: float, low: float, lines: Sequence[float]
) -> tuple[float, float]:
    """Frequencies [Hz] up to which a free map alone, and the motion, explain more than half of the effort's power.

    In whole half-octaves. The band includes one that is not explained where those above it make up for it: a vibration with little power
    far above the motion, which happens to be explained, does not.
    """
    edges = most / np.sqrt(2.0) ** np.arange(64)
    edges = edges[edges >= dominant]
    count = max(len(edges) - 1, 0)
    total, by_map, coherent = np.zeros(count), np.zeros(count), np.zeros(count)
    efforts, left = _residuals(motions, most, low, lines)
    for motion, effort, residual in zip(motions, efforts, left, strict=True):
        frequency, power, _ = _spectra(effort, motion, most)
        _, rest, linear = _spectra(residual, motion, most)
        for index in range(count):
            inside = (frequency <= edges[index]) & (frequency > edges[index + 1])
            total[index] += len(effort) * power[inside].sum()
            by_map[index] += len(effort) * rest[inside].sum()
            coherent[index] += len(effort) * linear[inside].sum()

    def highest(remains: Array) -> float:
        gained = np.cumsum((HALF * total - remains)[::-1])  # from the lowest half-octave on
        if not count or gained.max() <= 0.0:
            return float(edges[-1] if len(edges) else most)
        return float(edges[count - 1 - int(np.argmax(gained))])

    return highest(by_map), highest(by_map - coherent)


def _spectra(signal: Array, motion: Motion, frequency: float) -> tuple[Array, Array, Array]:
    """Frequencies (k,) [Hz], power (k,) of a signal below `frequency`, and its part (k,) that is coherent with the acceleration.

    Twice differentiated, the noise of a measured position grows with the square of the frequency. Where it exceeds the motion
    the coherence is below one half. Of a random signal a linear system fits 1 / K in K averages, which is taken off
    (G. C. Carter, C. H. Knapp, A. H. Nuttall, IEEE Trans. Audio Electroacoust. 21 (1973) 337). The effort of a machine that is
    driven by its base is computed from the acceleration itself, so that their coherence says nothing.
    """
    length = max(min(len(signal), 64), len(signal) // SEGMENTS)
    rate = 1.0 / motion.period
    frequencies, power = welch(signal, rate, nperseg=length)
    averages = (len(signal) - length // 2) // (length - length // 2)
    if averages < 2 or motion.driven_by_base:
        return frequencies, power, np.zeros(len(power))
    driven = motion.acceleration[_kept(motion, frequency)]
    _, own = welch(driven, rate, nperseg=length)
    _, cross = csd(signal, driven, rate, nperseg=length)
    linear = np.divide(np.abs(cross) ** 2, own, out=np.zeros(len(own)), where=own > 0.0)
    return frequencies, power, np.maximum((averages * linear - power) / (averages - 1), 0.0)


def _explained(
    motions: Sequence[Motion], frequency: float, low: float, lines: Sequence[float]
) -> tuple[float, float, float]:
    """Shares of the effort's power below the frequency that a free map alone, and the motion, explain; and that power, a mean square."""
    efforts, left = _residuals(motions, frequency, low, lines)
    total = sum(float(np.sum((one - np.mean(one)) ** 2)) for one in efforts)
    if total <= 0.0:
        return 0.0, 0.0, 0.0
    by_map, remains = 0.0, 0.0
    for motion, residual in zip(motions, left, strict=True):
        frequencies, _, linear = _spectra(residual, motion, frequency)
        power = float(residual @ residual)
        by_map += power
        remains += max(power - len(residual) * float(frequencies[1]) * float(linear.sum()), 0.0)
    return 1.0 - by_map / total, 1.0 - remains / total, total / sum(map(len, efforts))


def _left_out(motions: Sequence[Motion], motion: float, effort: float) -> tuple[float, float]:
    """Share of the power of the effort below `motion` [Hz] that lies above `effort` [Hz] where effort and acceleration are coherent,
    and the frequency [Hz] up to which they are."""
    total, above, highest = 0.0, 0.0, 0.0
    for one in motions:
        frequency, power, linear = _spectra(one.effort[_kept(one, motion)], one, motion)
        beyond = (effort < frequency) & (frequency <= motion) & (linear >= HALF * power) & (power > 0.0)
        total += len(one.time) * float(power.sum())
        above += len(one.time) * float(power[beyond].sum())
        highest = max(highest, float(np.max(frequency[beyond], initial=0.0)))
    return (above / total if total > 0.0 else 0.0), highest
