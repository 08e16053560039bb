"""Alignment: the offset between the clocks of two records of the same excitation.

Two recordings rarely start together or share a sample rate. The commands are the same in both. The maximum of their
cross-correlation gives the offset, which least squares refines below a sample. Without a command the phase of the forcing gives
it; without either, the motion itself, which then hides any constant delay.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import fminbound

from rhythmid.ltp.pumping import active_pumping
from rhythmid.record.outlier import USUAL
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import fast_length

Array = NDArray[np.float64]
Clock = Literal["command", "forcing", "output"]
MOST_SAMPLES = 200_000  # largest number of samples of a common grid
OVERLAP = 0.3  # share of the shorter record that must be common to both
# difference of the correlation within which other offsets of a periodic command are tried as well
CLOSE_CORRELATION = 0.03
TRIED = 12  # offsets of a periodic command that are tried
SAME = 0.05  # relative rms difference up to which two commands count as equal
TURN = 0.01  # phase difference [cycles] up to which the forcings count as in phase


@dataclass(frozen=True)
class Alignment:
    """Recording's time = simulation's time + `offset` ± `std` [s].

    `by` names the compared channel. `turn` [s] is the remaining time by which the simulation's forcing precedes the recording's
    (0 where they agree, or where only one is known). `difference` is the relative rms difference of the commands, None where
    there is none to compare. `mismatch` says why the excitations differ; empty where they do not.
    """

    by: Clock
    offset: float
    std: float
    turn: float = 0.0
    difference: float | None = None
    mismatch: str = ""


def smooth(channel: Channel) -> CubicSpline:
    """Cubic spline through the samples of a channel (at least two distinct ones)."""
    return CubicSpline(channel.time, channel.value)


def active(channel: Channel | None) -> bool:
    """Whether a channel varies."""
    return channel is not None and len(channel) > 8 and float(np.ptp(channel.value)) > 0.0


def white_level(value: Array) -> float:
    """Standard deviation of the white noise in samples (n,) of a smooth signal, in their unit, from third differences."""
    if len(value) < 16:
        return 0.0
    return float(USUAL * np.median(np.abs(np.diff(value, 3))) / math.sqrt(20.0))


def align(simulation: Record, recording: Record) -> Alignment:
    """Align a simulation with a recording. Raises InputError when they cannot overlap long enough to be compared."""
    if (
        simulation.input is not None
        and recording.input is not None
        and simulation.input_kind != recording.input_kind
    ):
        kinds = (
            f"the simulation's input is a {simulation.input_kind}, the recording's a {recording.input_kind}"
        )
        return replace(_by_output(simulation, recording), mismatch=kinds)
    given, seen = active(simulation.input), active(recording.input)
    if given and seen:
        assert simulation.input is not None and recording.input is not None
        return _by_command(simulation, recording, simulation.input, recording.input)
    found = _by_forcing(simulation, recording) or _by_output(simulation, recording)
    if given != seen:
        who = "only the simulation" if given else "only the recording"
        return replace(found, mismatch=f"{who} has a command that does anything")
    return found


def _correlation(recording: Array, simulation: Array) -> tuple[Array, NDArray[np.int64]]:
    """Normalised correlation of two signals on one grid, and its lags; lags with little overlap are weighted down."""
    n, m = len(recording), len(simulation)
    size = fast_length(n + m - 1)

    def correlate(a: Array, b: Array) -> Array:
        return np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)

    product = correlate(recording, simulation)
    one = correlate(recording**2, np.ones(m))
    other = correlate(np.ones(n), simulation**2)
    energy = np.maximum(one, OVERLAP * float(recording @ recording)) * np.maximum(
        other, OVERLAP * float(simulation @ simulation)
    )
    lags = np.concatenate([np.arange(n), np.arange(-(m - 1), 0)])
    places = lags % size
    common = np.minimum(n, m + lags) - np.maximum(0, lags)
    value = product[places] / np.sqrt(np.maximum(energy[places], 1e-300))
    value[common < OVERLAP * min(n, m)] = -1.0
    order = np.argsort(lags)
    return value[order], lags[order]


def _on_grid(channel: Channel, step: float) -> Array:
    count = int((channel.time[-1] - channel.time[0]) / step) + 1
    return np.interp(channel.time[0] + step * np.arange(count), channel.time, channel.value)


def _offsets(
    recording: Channel, simulation: Channel, centred: bool
) -> tuple[list[tuple[float, float]], float]:
    """Likely offsets [s] with their correlations, best first, and the grid's step [s]."""
    longest = max(c.time[-1] - c.time[0] for c in (recording, simulation))
    step = max(min(recording.period, simulation.period), longest / MOST_SAMPLES)
    a, b = _on_grid(recording, step), _on_grid(simulation, step)
    if centred:
        a, b = a - a.mean(), b - b.mean()
    value, lags = _correlation(a, b)
    peak = np.concatenate([[-np.inf], value, [-np.inf]])
    tops = np.flatnonzero(
        (value >= peak[:-2]) & (value >= peak[2:]) & (value >= value.max() - CLOSE_CORRELATION)
    )
    best = tops[np.argsort(-value[tops], kind="stable")][:TRIED]
    begin = float(recording.time[0] - simulation.time[0])
    return [(begin + step * float(lags[i]), float(value[i])) for i in best], step


def _refined(
    recording: Channel, simulation: Channel, offset: float, step: float
) -> tuple[float, float, float]:
    """Offset below a sample, its standard deviation, and the rms difference of the channels there relative to their rms."""
    known = smooth(simulation)
    inside = (recording.time > simulation.time[0] + offset + 2 * step) & (
        recording.time < simulation.time[-1] + offset - 2 * step
    )
    time, value = recording.time[inside], recording.value[inside]
    if len(time) < 8:
        return offset, math.inf, math.inf

    def left(shift: float) -> float:
        return float(np.sum((value - known(time - offset - shift)) ** 2))

    found = float(np.asarray(fminbound(left, -1.5 * step, 1.5 * step, xtol=1e-6 * step)))
    shift = found if left(found) < left(0.0) else 0.0
    slope = float(np.sum(known(time - offset - shift, 1) ** 2))
    variance = left(shift) / len(time)
    size = math.sqrt(max(float(np.mean(value**2)), float(np.mean(known(time - offset) ** 2)), 1e-300))
    return offset + shift, math.sqrt(variance / max(slope, 1e-300)), math.sqrt(variance) / size


def _forcings(simulation: Record, recording: Record, offset: float) -> tuple[float, str]:
    """Time [s] by which the simulation's forcing precedes the recording's at this offset, and other differences in words."""
    a, b = active_pumping(simulation), active_pumping(recording)
    if a is None or b is None:
        return 0.0, ""
    if abs(a.frequency - b.frequency) * recording.duration > 0.05:
        return (
            0.0,
            f"the forcing is at {a.frequency:.6g} Hz in the simulation and at {b.frequency:.6g} Hz in the recording",
        )
    size, other = np.linalg.norm(a.coefficients[1:]), np.linalg.norm(b.coefficients[1:])
    if abs(size - other) > SAME * max(size, other):
        return (
            0.0,
            f"the forcing's amplitude is {size:.4g} in the simulation and {other:.4g} in the recording",
        )
    period = b.period
    turn = (b.origin - a.origin - offset + 0.5 * period) % period - 0.5 * period
    return (float(turn) if abs(turn) > TURN * period else 0.0), ""


def _by_command(simulation: Record, recording: Record, sent: Channel, seen: Channel) -> Alignment:
    offsets, step = _offsets(seen, sent, centred=False)
    found: list[tuple[float, Alignment]] = []
    for start, correlation in offsets:
        offset, std, difference = _refined(seen, sent, start, step)
        turn, mismatch = _forcings(simulation, recording, offset)
        size = math.sqrt(float(np.mean(seen.value**2))) or 1.0
        if correlation < 0.5:
            mismatch = mismatch or "no stretch of the recorded command is the simulation's"
        elif difference > SAME + 3.0 * white_level(seen.value) / size:
            mismatch = (
                mismatch
                or f"the commands differ by {100 * difference:.0f} % of their size where they agree best"
            )
        agreement, common = _agreement(simulation, recording, offset)
        cost = difference + abs(turn) + 0.1 * (1.0 - agreement) + 0.2 * (1.0 - common)
        found.append((cost, Alignment("command", offset, std, turn, difference, mismatch)))
    return min(found, key=lambda pair: pair[0])[1]


def _agreement(simulation: Record, recording: Record, offset: float) -> tuple[float, float]:
    """Correlation of the motions at an offset, and the common share of the shorter record."""
    a, b = simulation.output, recording.output
    inside = (b.time >= a.time[0] + offset) & (b.time <= a.time[-1] + offset)
    common = float(inside.sum() * b.period / min(simulation.duration, recording.duration))
    if inside.sum() < 8:
        return -1.0, common
    one, other = np.interp(b.time[inside] - offset, a.time, a.value), b.value[inside]
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0, common
    return float(np.corrcoef(one, other)[0, 1]), common


def _by_forcing(simulation: Record, recording: Record) -> Alignment | None:
    """The offset that aligns the forcings; among those a period apart, the one with the best agreement of the motions."""
    a, b = active_pumping(simulation), active_pumping(recording)
    if a is None or b is None:
        return None
    turn = b.origin - a.origin
    first = float(recording.output.time[0] - simulation.output.time[-1])
    last = float(recording.output.time[-1] - simulation.output.time[0])
    least = OVERLAP * min(recording.duration, simulation.duration)
    counts = np.arange(
        math.ceil((first + least - turn) / b.period), math.floor((last - least - turn) / b.period) + 1
    )
    if not len(counts):
        return None
    offsets = [float(turn + count * b.period) for count in counts]
    near = sorted(offsets, key=lambda o: abs(o - (recording.output.time[0] - simulation.output.time[0])))
    offset = max(
        near[:200],
        key=lambda o: sum(w * part for w, part in zip((1.0, 0.2), _agreement(simulation, recording, o))),
    )
    _, mismatch = _forcings(simulation, recording, offset)
    return Alignment("forcing", offset, 0.0, mismatch=mismatch)


def _by_output(simulation: Record, recording: Record) -> Alignment:
    offsets, step = _offsets(recording.output, simulation.output, centred=True)
    found = [
        _refined(_centred(recording.output), _centred(simulation.output), start, step) for start, _ in offsets
    ]
    offset, std, _ = min(found, key=lambda one: one[2])
    return Alignment("output", offset, std)


def _centred(channel: Channel) -> Channel:
    return Channel(channel.time, channel.value - float(np.mean(channel.value)), channel.unit, channel.source)
