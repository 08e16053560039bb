"""Records prepared for the time domain: continuous inputs, measured samples, and a mask of the samples to use.

Block averages are compared: far above the machine's dynamics samples contain no information. The simulation is averaged in the same way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import PPoly

from rhythmid.errors import InputError
from rhythmid.identify.initial_step import HISTORY, stepped, value_before
from rhythmid.identify.inputs import Inputs, Pieces
from rhythmid.identify.motion_band import block_length, moving_part
from rhythmid.identify.noise import NoiseModel, runs
from rhythmid.identify.spread import relative_spreads
from rhythmid.motion_power import motion_power
from rhythmid.record.record import Record
from rhythmid.record.rounding import resolution
from rhythmid.record.timing import nominal_period
from rhythmid.simulation.right_hand_side import InputKind, OutputKind
from rhythmid.simulation.signal import FOR_EVER, continuous, fast_length, is_held, is_smooth, spline

# share of blocks with a gap above which timestamps are too uneven for averaging; rare gaps cost fewer
TORN = 0.1
# median difference between the steps of the samples and their period, as a share of it, above which samples come in bursts: then most
# steps are almost zero
BURST = 0.5
OFTEN = 0.5  # in blocks: interval of a held command below which the machine averages its steps
HELD_OUT = 0.2  # last part of each series, as a share, that is held out where no separate records are given
REACH = 2  # blocks on either side used in the differences of `of_block`
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Series:
    """One record's measurement with its inputs as functions of time.

    `time` (n,) [s] and `value` (n,) are the timestamps and samples of the measurement; `block` samples are averaged into one. `used` (n
    // block,) marks the averages that are fitted, `hidden` those that are held out. Averages in neither, such as gaps, are ignored.
    `period` [s] is the usual sample period. `ignored` (n // block, q) are signals that are projected out of the averages (the limit
    cycle's harmonics, where the cycle is not used as data). `parameters` are values of the model's parameters that the record
    declares; see `own_model`. `record` names the record of which the series is a stretch; it is empty for a whole record. `spread`
    (n // block,) is the standard deviation of each average's noise relative to its root mean square, where it varies: with
    timestamp jitter it grows with the slope of the signal. `resolution` is the step to which the samples were rounded, 0 where they
    were not. `colour` is the noise model, where its spectrum is known, such as that of the effect of command jitter. `zero` is the
    current estimate of the zero that was subtracted from the samples, relative to the first record; None where the zero is that of
    the first record; see `record_zero`. `origin` is the unmeasured start of the motion that the model integrates: for a stretch of
    a speed record, the displacement since the record began; see `displacement`. `inputs` are command and forcing in the form of the
    compiled loop, created automatically. `one_clock` is that of `Record`.
    """

    name: str
    time: Array
    value: Array
    command: PPoly | None
    forcing: PPoly | None
    block: int
    used: Mask
    period: float
    kind: InputKind = "force"
    measured: OutputKind = "position"
    ignored: Array | None = None
    hidden: Mask | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    record: str = ""
    spread: Array | None = None
    resolution: float = 0.0
    colour: NoiseModel | None = None
    zero: float | None = None
    origin: float = 0.0
    one_clock: bool = False
    inputs: Inputs = field(default=Inputs(None, None), repr=False)

    def __post_init__(self) -> None:
        """Reuse the inputs of the series from which this one was made, where the signals are the same."""
        if self.inputs.commanded is not self.command or self.inputs.forced is not self.forcing:
            object.__setattr__(self, "inputs", Inputs(self.command, self.forcing))

    @property
    def blocks(self) -> int:
        """Number of block averages."""
        return len(self.time) // self.block

    @cached_property
    def commanded(self) -> bool:
        """Whether the command changes during the series, or changed at its start: a constant command is no excitation."""
        return bool(np.ptp(self._commands) > 0.0)

    @property
    def _commands(self) -> Array:
        """Commands at the samples (n,), with the one before where a step begins the record (n + 1,)."""
        told = self._told(self.command)
        if (
            self.command is not None
            and self.time[0] - HISTORY <= self.command.x[0] + self.period < self.time[0]
        ):
            return np.insert(told, 0, self.command(self.command.x[0]))
        return told

    @property
    def channels(self) -> tuple[tuple[Array, bool], ...]:
        """Command and forcing at the samples (n,) or (n + 1,), and whether each is held between its samples."""
        both = (self.command, self._commands), (self.forcing, self._told(self.forcing))
        return tuple((told, signal is None or is_held(signal)) for signal, told in both)

    @cached_property
    def driven(self) -> bool:
        """Whether command or forcing change during the series."""
        return self.commanded or bool(np.ptp(self._told(self.forcing)) > 0.0)

    @property
    def drive(self) -> Array:
        """Sum of command and forcing at the samples (n,)."""
        return self._told(self.command) + self._told(self.forcing)

    def _told(self, signal: PPoly | None) -> Array:
        """Values (n,) of a signal at the samples, continued as `pieces` does. A signal that starts within one
        sample period of the record's start is taken to start with it, without a step."""
        if signal is None:
            return np.zeros(len(self.time))
        told = signal(np.clip(self.time, signal.x[0], min(signal.x[-1], FOR_EVER)))
        return np.where(is_held(signal) & (self.time < signal.x[0] - self.period), 0.0, told)

    def average(self, samples: Array) -> Array:
        """Block averages of samples (n,) or (n, q), shape (n // block, …)."""
        kept = samples[: self.blocks * self.block]
        return kept.reshape(self.blocks, self.block, *samples.shape[1:]).mean(axis=1)

    @cached_property
    def centres(self) -> Array:
        """Times of the block centres [s], at which the simulation is evaluated."""
        return self.average(self.time)

    def of_block(self, samples: Array) -> Array:
        """Block averages (n,) of a smooth signal from its values at the blocks' centres, by central differences.

        The average over b samples is a sum D = 1 + a δ² + c δ⁴ + … of differences between neighbouring blocks,
        exact to the fourth order in frequency. At the ends the differences are extrapolated. Where samples are
        missing, δ² is the divided difference over the existing sample times, and a is the spread of those times
        about their mean.
        """
        if self.block == 1 or len(samples) < 8:
            return samples
        once = 1.0 / self.block**2
        c = (1.0 / 120.0 - once / 36.0 + 7.0 * once**2 / 360.0) / 16.0 - (1.0 - once) / 288.0
        bend = _extended(self._bend(samples))
        slope = bend[1:] - bend[:-1]
        return samples + self._spread * bend + c * _extended(slope[1:] - slope[:-1])

    def _bend(self, samples: Array) -> Array:
        """δ² of values at the blocks' centres: their second derivative times the usual distance of blocks, squared."""
        before, after = self._weights
        slope = samples[1:] - samples[:-1]
        return after * slope[1:] - before * slope[:-1]

    @cached_property
    def _weights(self) -> tuple[Array, Array]:
        """Weights in δ² of the differences to the previous and to the next block; both 1 where no sample is missing."""
        apart = np.diff(self.centres) / (self.block * self.period)
        around = 0.5 * (apart[1:] + apart[:-1])
        return 1.0 / (around * apart[:-1]), 1.0 / (around * apart[1:])

    @cached_property
    def _spread(self) -> Array:
        """Half the variance of the sample times in each block, over the usual distance of blocks squared: a of D."""
        kept = self.time[: self.blocks * self.block]
        away = (kept - np.repeat(self.centres, self.block)) / (self.block * self.period)
        return 0.5 * (away**2).reshape(self.blocks, self.block).mean(axis=1)

    @property
    def smooth(self) -> Pieces | None:
        """The command if it is smooth, or the smooth surrogate of a held one; None where there is none.

        A surrogate is used for a command that is held at even intervals and changes several times in a block, or about as
        often as the measurement is sampled where samples are averaged.
        """
        if self.command is None or not is_held(self.command):
            return None if self.command is None or not is_smooth(self.command) else self.inputs.command
        often = max(2.0 * self.period if self.block > 1 else 0.0, OFTEN * self.block * self.period)
        return self.inputs.smooth if self.inputs.even_tick <= often * (1.0 + 1e-6) else None

    @cached_property
    def averaged(self) -> Array:
        """Block averages of the measurement."""
        return self.average(self.value)

    def counted(self, hidden: bool = False) -> Mask:
        """Mask (n // block,) of the fitted averages, or of the held-out ones."""
        if not hidden:
            return self.used
        return np.zeros(self.blocks, bool) if self.hidden is None else self.hidden

    def spread_of(self, part: slice) -> Array:
        """Relative standard deviation (m,) of the noise of the averages `part`."""
        return np.ones(self.blocks)[part] if self.spread is None else self.spread[part]

    def levelled(self, samples: Array, part: slice = slice(None)) -> Array:
        """Samples of the averages `part`, (m,) or (m, q), divided by the relative standard deviation of their
        noise, for whitening and weighting; unchanged where the noise is uniform."""
        if self.spread is None:
            return samples
        return samples / self.spread[part].reshape(-1, *[1] * (samples.ndim - 1))

    def stretches(self, noise: NoiseModel, hidden: bool = False) -> tuple[slice, ...]:
        """Stretches of the fitted averages, or of the held-out ones, that are long enough for whitening."""
        return tuple(s for s in runs(self.counted(hidden)) if s.stop - s.start > noise.order + 1)

    def whitened(self, noise: NoiseModel, samples: Array, parts: Sequence[slice]) -> Array:
        """Samples of the averages (n // block,) or (n // block, q) in these stretches, levelled, whitened and joined."""
        white = [noise.whiten(self.levelled(samples[part], part)) for part in parts]
        return np.concatenate(white) if white else samples[:0]

    def power(self, chosen: Mask) -> float:
        """Sum of squares of the motion over the chosen averages, as the reference for relative errors; see
        `motion_power`."""
        return motion_power(self.averaged, chosen)


def _extended(samples: Array) -> Array:
    """Samples (n,) extended by one at either end, with the cubic through the last four samples there."""
    longer = np.empty(len(samples) + 2)
    longer[1:-1] = samples
    if len(samples) > 3:
        longer[0] = 4.0 * samples[0] - 6.0 * samples[1] + 4.0 * samples[2] - samples[3]
        longer[-1] = 4.0 * samples[-1] - 6.0 * samples[-2] + 4.0 * samples[-3] - samples[-4]
    else:
        longer[0], longer[-1] = samples[0], samples[-1]
    return longer


def _spline_of(time: Array, value: Array) -> PPoly:
    keep = np.concatenate([[True], np.diff(time) > 0])
    return spline(time[keep], value[keep])


def _held_before(time: Array, value: Array) -> tuple[Array, Array]:
    """A reference with its first value held before the record, because the machine was already there."""
    step = nominal_period(np.diff(time))
    count = int(np.clip(np.ceil(1.0 / step), 1, 10_000))
    earlier = time[0] + step * np.arange(-count, 0)
    return np.concatenate([earlier, time]), np.concatenate([np.full(count, value[0]), value])


def prepare(records: Sequence[Record], block: int | None = None) -> list[Series]:
    """Series of all records. With `block` None the averaging is chosen from the records' bandwidth; samples with uneven
    timestamps are not averaged.

    Raises InputError for a record that is too short, or with values that are not finite.
    """
    made = [_series_of(record) for record in records]
    if block is None:
        block = min(block_length(s.value, s.period) for s in longest_of_each(made))
    whole = [_whole_blocks(s, block) for s in made]
    if np.concatenate(whole).mean() < 1.0 - TORN or any(map(_in_bursts, made)):
        block, whole = 1, [np.ones(len(s.time), bool) for s in made]
    made = [replace(s, block=block, used=used) for s, used in zip(made, whole)]
    stamped = [s for s, record in zip(made, records, strict=True) if record.stamped]
    spreads = iter(relative_spreads([(record_of(s), s.time, s.value) for s in stamped], block))
    return [
        replace(s, spread=next(spreads)) if record.stamped else s
        for s, record in zip(made, records, strict=True)
    ]


def _series_of(record: Record) -> Series:
    """The series of a record, not averaged."""
    _check(record)
    time, value, forcing = record.output.time, record.output.value, record.forcing
    if len(time) < 16:
        raise InputError(f"{record.name}: has only {len(time)} samples of the output; at least 16 are needed")
    return Series(
        record.name,
        time,
        value,
        _command_of(record),
        _spline_of(forcing.time, forcing.value) if forcing is not None and forcing.value.any() else None,
        1,
        np.ones(len(time), bool),
        nominal_period(np.diff(time)),
        record.input_kind,
        record.output_kind,
        parameters=record.parameters,
        record=record.whole,
        resolution=resolution(value),
        one_clock=record.one_clock,
    )


def _command_of(record: Record) -> PPoly | None:
    """The command between its samples, as the record says that it is held."""
    given, before = record.input, value_before(record)
    if given is None or len(given.time) < 2:
        return None
    if before is not None:
        return stepped(record, before)
    if record.hold == "zero" and record.input_kind == "base_displacement":
        return _spline_of(given.time, given.value)
    if record.hold == "zero" and record.input_kind == "reference":
        return continuous(*_held_before(given.time, given.value), "zero")
    return continuous(given.time, given.value, record.hold)


def record_of(series: Series) -> str:
    """Name of the record to which a series belongs."""
    return series.record or series.name


def longest_of_each(series: Sequence[Series]) -> list[Series]:
    """The longest stretch of each record."""
    found: dict[str | int, Series] = {}
    for index, one in enumerate(series):
        key = one.record or index
        if key not in found or len(one.time) > len(found[key].time):
            found[key] = one
    return list(found.values())


def _check(record: Record) -> None:
    for what, channel in (("output", record.output), ("input", record.input), ("forcing", record.forcing)):
        if channel is None or np.isfinite(channel.value).all():
            continue
        bad = np.flatnonzero(~np.isfinite(channel.value))
        raise InputError(
            f"{record.name}: {len(bad)} values of the {what} are not finite, the first of them at "
            f"t = {channel.time[bad[0]]:g} s; take these samples out"
        )


def _in_bursts(series: Series) -> bool:
    """Whether most samples came together with others, as from a log that releases them late."""
    return float(np.median(np.abs(np.diff(series.time) / series.period - 1.0))) > BURST


def _whole_blocks(series: Series, block: int) -> Mask:
    """Blocks without a gap in themselves or in the neighbours whose differences `of_block` uses."""
    n = len(series.time) // block
    if block == 1:
        return np.ones(n, bool)
    times = series.time[: n * block].reshape(n, block)
    most = 1.5 * block * series.period
    broken = times[:, -1] - times[:, 0] >= most
    apart = np.flatnonzero(np.diff(times.mean(axis=1)) >= most)  # between this block and the next
    for near in range(1 - REACH, REACH + 1):
        broken[np.clip(apart + near, 0, n - 1)] = True
    return ~broken


def displacement(series: Series) -> Array:
    """Position (n,) at the samples of a series whose speed is measured, starting at `origin`."""
    return series.origin + cumulative_trapezoid(series.value, series.time, initial=0.0)


def hold_out_tail(series: Sequence[Series]) -> tuple[list[Series], list[Series]]:
    """Each series with its last part held out, and the same series with only that part to be scored."""
    seen, unseen = [], []
    for one in series:
        last = np.arange(one.blocks) >= round((1.0 - HELD_OUT) * one.blocks)
        seen.append(replace(one, used=one.used & ~last, hidden=one.used & last))
        unseen.append(replace(one, used=one.used & last))
    return seen, unseen


def dominant_frequency(series: Series, finer: int = 1) -> float:
    """Frequency [Hz] of the strongest line of the motion, on a grid `finer` times as fine as the record's resolution."""
    value = moving_part(series.averaged)
    value = value - value.mean()
    length = fast_length(finer * len(value))
    power = np.abs(np.fft.rfft(value * np.hanning(len(value)), length)) ** 2
    power[0] = 0.0
    return float(max(1, int(np.argmax(power))) / (length * series.period * series.block))
