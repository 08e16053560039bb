"""Spectra of a record over a whole number of pumping periods, without the warm-up, and with the limit cycle separated.

Over a window of P periods the limit cycle occupies the bins nP only. If the command before the window repeats at
the window's end (chirps in a cycle, a multisine, or silence), the response is periodic, too, and there is no
leakage. The window is chosen accordingly.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.errors import InputError
from rhythmid.ltp.pumping import Pumping
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import continuous, fast_length

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
RING_DOWNS = 12.0  # warm-up in ring-downs: e^-12 = 6e-6 of any transient remains
# [rad] phase per cell of the integrated input at the highest frequency; relative error FINE^2 / 12
FINE = 0.03


@dataclass(frozen=True)
class Window:
    """Start [s] in the record's time, number of whole `periods` P, and the `leakage` into the spectra.

    The leakage is the rms difference between the commands before `start` and before the end of the window, relative
    to the command and weighted by the machine's memory.
    """

    start: float
    periods: int
    leakage: float


@dataclass(frozen=True, eq=False)
class Spectra:
    """Fourier integrals over the window, in cycle time, at the bins l = 0 … L of width 1/(P T).

    Attributes
    ----------
    input, output : complex128[L + 1] U(jω_l), Y(jω_l) [unit s].
    cycle : complex128[n] Fourier coefficients X_0, X_1, … of the measured limit cycle (with its delay), in cycle time.
    """

    pumping: Pumping
    window: Window
    input: Complex
    output: Complex
    cycle: Complex

    @property
    def resolution(self) -> float:
        """Width of a bin [Hz]."""
        return self.pumping.frequency / self.window.periods

    @property
    def frequency(self) -> Array:
        """Frequencies of the bins [Hz]."""
        return np.arange(float(len(self.input))) * self.resolution

    def shifted_input(self, harmonics: NDArray[np.int64], bins: NDArray[np.int64]) -> Complex:
        """U(j(ω_l − mω_p)) for harmonics m (h,) and bins l (n,), zero beyond the spectrum; shape (h, n)."""
        index = bins[None, :] - np.asarray(harmonics)[:, None] * self.window.periods
        inside = np.abs(index) < len(self.input)
        value = self.input[np.where(inside, np.abs(index), 0)]
        return np.where(inside, np.where(index < 0, value.conj(), value), 0.0)

    def output_at(self, bins: NDArray[np.int64]) -> Complex:
        """Y(jω_l) for bins l (n,) of either sign."""
        value = self.output[np.abs(bins)]
        return np.where(bins < 0, value.conj(), value)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] of the input: mean power above 1 % of its maximum.

        Raises InputError when there is no input.
        """
        power = np.abs(self.input) ** 2
        power[:: self.window.periods] = 0.0
        wide = max(1, round(0.1 / self.resolution))
        mean = np.convolve(power, np.ones(wide) / wide, mode="same")
        reached = np.flatnonzero(mean > 0.01 * mean.max())
        if len(reached) == 0 or mean.max() == 0.0:
            raise InputError("the input is silent: there is nothing to identify transfer functions from")
        return float(reached[0] * self.resolution), float(reached[-1] * self.resolution)


def steady_window(record: Record, period: float, ring_down: float) -> Window:
    """The longest window of whole periods [s] whose command repeats, after a warm-up of twelve ring-downs [s].

    The warm-up is limited to a quarter of the record where the ring-down is longer. Raises InputError when the
    record is shorter than a period.
    """
    output, command = record.output, record.input
    low, high = float(output.time[0]), float(output.time[-1]) + output.period
    if command is not None:
        low, high = max(low, float(command.time[0])), min(high, float(command.time[-1]) + command.period)
    duration = high - low
    if duration < period:
        raise InputError(
            f"{record.name}: the recording lasts {duration:.4g} s, less than one pumping period of {period:.4g} s"
        )
    memory = min(RING_DOWNS * ring_down, 0.25 * duration)
    most = max(1, int((duration - memory) / period + 1e-9))
    if command is None:
        return Window(_on_sample(output, high - most * period), most, 0.0)
    back = np.linspace(0.0, memory, 2000) if memory > 0 else np.zeros(1)
    weight = np.exp(-back / ring_down) if np.isfinite(ring_down) and ring_down > 0 else np.ones(len(back))
    size = float(np.sqrt(np.mean(command.value**2))) or 1.0
    counts = np.arange(most, max(0, most // 2), -1)

    def value(at: Array) -> Array:
        return command.value[np.clip(np.searchsorted(command.time, at + 1e-9, side="right") - 1, 0, None)]

    at_end = value(high - 1e-6 - back)
    leakage = np.array(
        [np.sqrt(np.average((value(high - 1e-6 - n * period - back) - at_end) ** 2, weights=weight)) for n in counts]
    ) / size  # fmt: skip
    # the chirps' samples fall at slightly different phases in each repetition
    good = np.flatnonzero(leakage < 1e-2)
    best = int(good[0]) if len(good) else int(np.argmin(leakage)) if leakage.min() < 0.5 * leakage[0] else 0
    count = int(counts[best])
    return Window(_on_sample(output, high - count * period), count, float(leakage[best]))


def _on_sample(channel: Channel, time: float) -> float:
    """The last sample time not after `time` [s] (to a nanosecond)."""
    return float(channel.time[max(0, np.searchsorted(channel.time, time + 1e-9, side="right") - 1)])


def _input_integral(record: Record, window: Window, period: float, bins: int) -> Complex:
    """∫ u(t) exp(−jω_l t) dt over the window for l = 0 … bins, with t from its start; the hold is integrated exactly."""
    command = record.input
    if command is None or np.ptp(command.value) == 0.0:
        return np.zeros(bins + 1, dtype=complex)
    length = window.periods * period
    highest = 2.0 * np.pi * bins / length
    cells = fast_length(max(2 * bins + 2, int(np.ceil(length * highest / FINE))))
    edges = window.start + np.linspace(0.0, length, cells + 1)
    if record.hold == "zero":  # the integral of a held signal is piecewise linear
        total = np.concatenate([[0.0], np.cumsum(command.value[:-1] * np.diff(command.time))])
        integral = np.interp(edges, command.time, total)
        late = edges > command.time[-1]
        integral[late] = total[-1] + command.value[-1] * (edges[late] - command.time[-1])
    else:
        integral = continuous(command.time, command.value, record.hold).antiderivative()(edges)
    spectrum = np.fft.rfft(np.diff(integral))[: bins + 1]
    return spectrum * np.exp(-1j * np.pi * np.arange(bins + 1) / cells)  # a cell represents its midpoint


def highest_input(record: Record) -> float:
    """Frequency [Hz] up to which the input has power (1e-6 of its greatest density is neglected); 0 for none or a
    constant one."""
    command = record.input
    if command is None or len(command) < 8 or not np.any(command.value):
        return 0.0
    length = fast_length(len(command))
    power = np.abs(np.fft.rfft(command.value - command.value.mean(), length)) ** 2
    width = 1.0 / (length * command.period)
    wide = max(1, round(0.1 / width))
    mean = np.convolve(power, np.ones(wide) / wide, mode="same")
    return float(np.flatnonzero(mean > 1e-6 * mean.max())[-1] * width)


def spectra(
    record: Record,
    pumping: Pumping,
    ring_down: float,
    sidebands: int = 4,
    window: Window | None = None,
    cycle: int = 8,
) -> Spectra:
    """Spectra of a record up to `sidebands` pumping frequencies above its input's band.

    `ring_down` [s] of the machine determines the warm-up; `cycle` harmonics of the limit cycle are kept. The output
    is interpolated to a whole number of samples per period (its own samples where that holds already). Raises
    InputError when the record is too short.
    """
    period = pumping.period
    chosen = window or steady_window(record, period, ring_down)
    output = record.output
    samples = max(4, int(np.ceil(period / output.period - 1e-6)))
    total = samples * chosen.periods
    highest = highest_input(record) + sidebands * pumping.frequency
    bins = min(int(highest * chosen.periods * period), total // 2 - 1)
    grid = chosen.start + np.arange(total) * (period / samples)
    near = (output.time > grid[0] - 20 * output.period) & (output.time < grid[-1] + 20 * output.period)
    apart = np.concatenate([[True], np.diff(output.time[near]) > 0.1 * output.period])
    value = CubicSpline(output.time[near][apart], output.value[near][apart])(
        np.minimum(grid, output.time[-1])
    )
    step = period / samples
    omega = 2.0 * np.pi * np.arange(bins + 1) / (chosen.periods * period)
    turn = np.exp(-1j * omega * (chosen.start - pumping.origin))
    whole = np.fft.rfft(value)
    lines = whole[:: chosen.periods][: min(cycle + 1, samples // 2)] / total
    lines = lines * np.exp(-1j * pumping.omega * np.arange(len(lines)) * (chosen.start - pumping.origin))
    return Spectra(
        pumping,
        chosen,
        _input_integral(record, chosen, period, bins) * turn,
        whole[: bins + 1] * step * turn,
        lines,
    )
