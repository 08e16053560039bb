"""A simulated and a recorded motion at common times, with their known inputs."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.compare.align import Alignment, active, smooth, white_level
from rhythmid.compare.oscillator import Oscillator, oscillator_of, ringing
from rhythmid.errors import InputError
from rhythmid.identify.motion_band import bandwidth, block_length
from rhythmid.ltp.pumping import active_pumping
from rhythmid.record.record import Record

Array = NDArray[np.float64]
FEWEST_SAMPLES = 64  # minimum number of common samples
COMMON_PERIODS = 2.0  # minimum number of common periods of the motion
HARMONICS = 12  # harmonics of the forcing in a limit cycle


@dataclass(frozen=True, eq=False)
class Pair:
    """Two motions (n,) on one even grid with step `step` [s], in the recording's time.

    `cycle` is the part of the simulated motion that repeats with the forcing, its mean included. It is None without forcing or
    command; channel corrections then cannot be told apart. `command`, `effort` (forcing plus command) and `phase` in [0, 1) are
    given where known. `used` marks the samples that are compared. `noise` is the standard deviation of white noise in the
    difference. `frequency` [Hz] is that of the dominant motion, `pumping` [Hz] that of the forcing. Beyond `bandwidth` [Hz] there is
    no motion. `oscillator` gives the response to small forces.
    """

    time: Array
    step: float
    recording: Array
    simulation: Array
    used: NDArray[np.bool_]
    noise: float
    frequency: float
    bandwidth: float
    oscillator: Oscillator
    cycle: Array | None = None
    command: Array | None = None
    effort: Array | None = None
    phase: Array | None = None
    pumping: float | None = None

    @property
    def velocity(self) -> Array:
        """Velocity of the recorded motion, low-pass filtered at twice its bandwidth."""
        n = len(self.recording)
        line = np.linspace(self.recording[0], self.recording[-1], n)
        mirrored = np.concatenate([self.recording - line, -(self.recording - line)[-2:0:-1]])
        spectrum = np.fft.rfft(mirrored)
        frequency = np.arange(len(spectrum)) / (len(mirrored) * self.step)
        spectrum = spectrum * np.exp(-((frequency / (2.0 * self.bandwidth)) ** 4)) * 2j * np.pi * frequency
        slope = (self.recording[-1] - self.recording[0]) / ((n - 1) * self.step)
        return np.asarray(np.fft.irfft(spectrum, len(mirrored)))[:n] + slope


def harmonic_columns(time: Array, frequency: float, count: int) -> Array:
    """A constant, and cosines and sines of `count` harmonics at times [s], (n, 2 count + 1)."""
    angle = 2.0 * np.pi * frequency * np.multiply.outer(time, np.arange(1, count + 1))
    return np.hstack([np.ones((len(time), 1)), np.cos(angle), np.sin(angle)])


def pair_of(simulation: Record, recording: Record, alignment: Alignment) -> tuple[Pair, list[str]]:
    """Both motions at common times, and notes. Raises InputError when they have too little in common."""
    offset = alignment.offset
    _check(simulation)
    _check(recording)
    rate = min(1.0 / simulation.output.period, 1.0 / recording.output.period)
    grid = recording.uniform(rate)
    inside = (grid.time >= simulation.output.time[0] + offset) & (
        grid.time <= simulation.output.time[-1] + offset
    )
    common, value = grid.time[inside], np.asarray(grid.output[inside])
    if len(common) < FEWEST_SAMPLES:
        raise InputError(
            f"{simulation.name} and {recording.name} have only {len(common) / rate:.3g} s in common "
            f"(offset {offset:.4g} s by the {alignment.by}); record longer, or check that both ran the same experiment"
        )
    block = block_length(value, grid.period)
    count = len(common) // block

    def average(samples: Array) -> Array:
        return np.asarray(samples)[: count * block].reshape(count, block).mean(axis=1)

    time, step, real = average(common), block * grid.period, average(value)
    frequency = _dominant(real, step)
    if frequency * (time[-1] - time[0]) < COMMON_PERIODS:
        raise InputError(
            f"{simulation.name} and {recording.name} have {frequency * (time[-1] - time[0]):.2g} periods of the motion in common "
            f"({time[-1] - time[0]:.3g} s); at least {COMMON_PERIODS:g} are needed"
        )
    simulated = average(smooth(simulation.output)(common - offset))
    command = None if grid.input is None else average(grid.input[inside])
    forcing = None if grid.forcing is None else average(grid.forcing[inside])
    efforts = [one for one in (command, forcing) if one is not None and np.ptp(one) > 0.0]
    effort = np.sum(efforts, axis=0) if efforts else None
    highest = min(bandwidth(value, grid.period), 0.5 / step)
    pumped = active_pumping(recording)
    levels = (white_level(one.output.value) for one in (recording, simulation))
    noise = math.hypot(*levels) / math.sqrt(block)
    oscillator = None if effort is None else oscillator_of(effort, simulated, step, frequency, highest)
    if oscillator is None:
        oscillator = _free(
            real, simulated, time, step, noise, effort is None, None if pumped is None else pumped.frequency
        )
    pair = Pair(
        time, step, real, simulated, average(grid.valid[inside].astype(float)) == 1.0, noise, frequency, highest,
        oscillator or Oscillator(3.0 * np.pi * frequency, 1.5 * np.pi * frequency), None, command, effort,
        None if pumped is None else ((time - pumped.origin) * pumped.frequency) % 1.0,
        None if pumped is None else pumped.frequency,
    )  # fmt: skip
    if pumped is None or command is None or not active(recording.input):
        return pair, []
    return _with_cycle(pair, pumped.frequency, alignment.turn)


def _check(one: Record) -> None:
    """Raise InputError for a record with too little to compare."""
    if len(one.output) < FEWEST_SAMPLES:
        raise InputError(
            f"{one.name}: has only {len(one.output)} samples of the output; {FEWEST_SAMPLES} are needed to compare"
        )
    if np.ptp(one.output.value) == 0.0:
        raise InputError(f"{one.name}: the output never changes; there is nothing to compare")


def _dominant(motion: Array, step: float) -> float:
    """Frequency [Hz] of the strongest line of a motion (n,)."""
    power = np.abs(np.fft.rfft((motion - motion.mean()) * np.hanning(len(motion)))) ** 2
    return max(1, int(np.argmax(power[1:])) + 1) / (len(motion) * step)


def _free(
    real: Array, simulated: Array, time: Array, step: float, noise: float, free: bool, pumping: float | None
) -> Oscillator | None:
    """The oscillator where no force with enough frequencies is known; None if the motion does not ring.

    Fitted to the simulated motion if that is `free`, else to the difference without the harmonics of the forcing.
    """
    if free and pumping is None:
        return ringing(simulated, step, _dominant(simulated, step))
    rest = real - simulated
    if pumping is not None:
        columns = harmonic_columns(time, pumping, int(np.clip(0.25 / (step * pumping), 1, HARMONICS)))
        rest = rest - columns @ np.linalg.lstsq(columns, rest, rcond=1e-10)[0]
    if np.std(rest) < 3.0 * noise:
        return None
    return ringing(rest, step, _dominant(rest, step))


def _with_cycle(pair: Pair, frequency: float, turn: float) -> tuple[Pair, list[str]]:
    """The pair with the simulation's limit cycle separated from its response to the command.

    If the command began `turn` [s] elsewhere in the forcing's cycle, both are shifted separately.
    """
    assert pair.command is not None
    count = int(np.clip(0.25 / (pair.step * frequency), 1, HARMONICS))
    periodic = harmonic_columns(pair.time, frequency, count)
    answer = pair.oscillator.response(_late_start(pair), pair.step)
    free = pair.oscillator.free(pair.time)
    solution = np.linalg.lstsq(np.hstack([periodic, answer, free]), pair.simulation, rcond=1e-10)[0]
    cycle = periodic @ solution[: periodic.shape[1]]
    if turn == 0.0:
        return replace(pair, cycle=cycle), []
    turned = harmonic_columns(pair.time - turn, frequency, count) @ solution[: periodic.shape[1]]
    note = (
        f"the command began {abs(turn):.4g} s {'later' if turn < 0 else 'earlier'} in the forcing's cycle than in the simulation: limit cycle and "
        "response to the command were shifted each for itself, which sidebands do not follow; with --model the model is run instead"
    )
    return replace(pair, cycle=turned, simulation=pair.simulation - cycle + turned), [note]


def _late_start(pair: Pair) -> Array:
    """The command, and the command delayed by at least a sample, (n, 2): their combination lets a fit adjust the delay."""
    assert pair.command is not None
    shift = max(1, round(0.02 / (pair.frequency * pair.step)))
    late = np.concatenate([np.full(shift, pair.command[0]), pair.command[:-shift]])
    return np.column_stack([pair.command, late])
