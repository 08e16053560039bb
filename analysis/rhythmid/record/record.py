"""Record: the channels of one recording, each with its own times, and resampled to one uniform grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhythmid.errors import InputError
from rhythmid.record.interpolation import interpolation_errors
from rhythmid.record.quality import Quality
from rhythmid.record.signals import ROLES, InputKind, OutputKind, Sinusoid
from rhythmid.record.timing import SAME, gaps_between, nominal_period
from rhythmid.result import Result, Row, axis_or_new, optional
from rhythmid.simulation.signal import Hold, continuous

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from rich.console import Console

Array = NDArray[np.float64]
FEWEST_COMMON_SAMPLES = 8  # least number of samples common to all channels
# ratio to the error of a cubic across one missing sample below which a cubic across one more is acceptable
AS_GOOD = 3.0
LEAST_STEP_IN_PERIODS = 0.1  # in periods; samples that follow sooner are left out of an interpolation


@dataclass(frozen=True, eq=False)
class Channel:
    """Samples of one signal.

    Attributes
    ----------
    time
        Float64[n], increasing, relative to the record's start [s].
    value
        Float64[n], in `unit`.
    unit
        SI unit, such as "m" or "N".
    source
        Topic and field, or column, of the samples.

    Examples
    --------
    >>> import numpy as np
    >>> channel = Channel(np.arange(5) * 0.25, np.zeros(5), "m")
    >>> len(channel), channel.period
    (5, 0.25)
    """

    time: Array
    value: Array
    unit: str
    source: str = ""

    def __len__(self) -> int:
        return len(self.time)

    @property
    def period(self) -> float:
        """Nominal time between samples [s]; infinite for a single sample."""
        return nominal_period(np.diff(self.time)) if len(self) > 1 else np.inf


@dataclass(frozen=True, eq=False)
class Uniform:
    """Channels of a record at common, evenly spaced times.

    Attributes
    ----------
    time
        Float64[n], relative to the record's start [s].
    input, output, forcing, velocity, effort, reference
        Float64[n] or None, in the units of the record's channels.
    period, rate
        Of the grid [s, Hz].
    valid
        Bool[n]; False where a channel has a gap that cannot be interpolated reliably from its neighbours.
    missing
        Bool[n]; True within any gap of a channel, whether it can be interpolated or not.
    """

    time: Array
    output: Array
    period: float
    valid: NDArray[np.bool_]
    missing: NDArray[np.bool_]
    input: Array | None = None
    forcing: Array | None = None
    velocity: Array | None = None
    effort: Array | None = None
    reference: Array | None = None

    @property
    def rate(self) -> float:
        return 1.0 / self.period

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, eq=False)
class Record(Result):
    """One recording, cut to its used part.

    Attributes
    ----------
    input
        Signal that drives the machine; None in a free decay.
    output
        The measured motion.
    forcing, velocity, effort, reference
        Where recorded; `effort` is the total actuator force.
    start_ns
        Time of the record's zero on the recording's clock [ns].
    hold
        Interpolation of the input between its samples. With 'zero', a value holds from its stamp until the next one.
    input_kind
        Force, base_displacement, base_acceleration or reference (of a controller that the model holds).
    output_kind
        Position, velocity or acceleration.
    forcing_law
        Formula of the forcing, if it is given by one; `forcing` then holds samples of it.
    run
        Description of the experiment in the recording itself.
    parameters
        Declared values of the model's parameters in this record, by "element.parameter".
    whole
        Name of the record of which this is a stretch; empty for a whole one.
    stamped
        Whether the output's times are measured timestamps, which may jitter; False where they follow from a
        declared rate.
    one_clock
        Whether all channels are columns of one table with one time, so that there is no clock drift between them.
    use_zero
        Time [s] of the record's zero on the clock on which `use:` counts: that of a table that did not start with it.

    Examples
    --------
    A record from arrays; `rhythmid.load` reads one from a bag or a table.

    >>> import numpy as np
    >>> time = np.arange(0.0, 10.0, 0.01)
    >>> record = Record("swing", Channel(time, 0.1 * np.cos(time), "rad"), Channel(time, np.zeros(1000), "N*m"))
    >>> list(record.channels)
    ['input', 'output']
    >>> record.headline
    'swing: 9.99 s of position at 100 Hz'
    """

    name: str
    output: Channel
    input: Channel | None = None
    forcing: Channel | None = None
    velocity: Channel | None = None
    effort: Channel | None = None
    reference: Channel | None = None
    start_ns: int = 0
    hold: Hold = "zero"
    input_kind: InputKind = "force"
    quality: Quality = field(default_factory=lambda: Quality({}))
    forcing_law: Sinusoid | None = None
    run: Mapping[str, Any] | None = None
    output_kind: OutputKind = "position"
    parameters: Mapping[str, float] = field(default_factory=dict)
    whole: str = ""
    stamped: bool = True
    one_clock: bool = False
    use_zero: float = 0.0

    @property
    def channels(self) -> dict[str, Channel]:
        """Channels that the record has, by role."""
        return {role: channel for role in ROLES if (channel := getattr(self, role)) is not None}

    @property
    def duration(self) -> float:
        """Time from the first to the last output sample [s]."""
        return float(self.output.time[-1] - self.output.time[0])

    @property
    def headline(self) -> str:
        """Name, duration and measured quantity."""
        return (
            f"{self.name}: {self.duration:.4g} s of {self.output_kind} at {1.0 / self.output.period:.4g} Hz"
        )

    def __repr__(self) -> str:
        """Headline and channels, without the samples."""
        return f"<Record {self.headline}; {', '.join(self.channels)}>"

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`channels`: number of samples, rate and source of each."""
        return {
            "channels": [
                {
                    "channel": role,
                    "samples": len(c),
                    "rate": 1.0 / c.period,
                    "unit": c.unit,
                    "source": c.source,
                }
                for role, c in self.channels.items()
            ]
        }

    def to_dataframe(self, table: str | None = None) -> "pd.DataFrame":
        """All channels at common times [s], which are the index; or the table `channels`.

        Raises InputError where the channels have too little in common, or pandas is not installed.
        """
        if table is not None:
            return super().to_dataframe(table)
        pandas, uniform = optional("pandas", "to_dataframe"), self.uniform()
        columns = {role: getattr(uniform, role) for role in self.channels}
        return pandas.DataFrame(columns, index=pandas.Index(uniform.time, name="time"))

    def to_dict(self) -> dict[str, Any]:
        """Name, duration, channels and quality as plain JSON data, without the samples."""
        return {
            "name": self.name,
            "duration": self.duration,
            "channels": {row["channel"]: dict(row) for row in self.tables()["channels"]},
            "quality": {role: one.to_dict() for role, one in self.quality.channels.items()},
            "notes": list(self.quality.notes),
        }

    def show(self, console: "Console") -> None:
        """Print the channels and their quality."""
        from rhythmid.report.terminal_table import print_table

        rows = [
            tuple(f"{v:.6g}" if isinstance(v, float) else str(v) for v in row.values())
            for row in self.tables()["channels"]
        ]
        print_table(console, self.headline, ("channel", "samples", "rate [Hz]", "unit", "source"), rows)
        for note in self.quality.notes:
            console.print(f"note: {note}", markup=False)

    def plot(self, axis: "Axes | None" = None, role: str = "output") -> "Axes":
        """Draw one channel over time; on a new figure where no axis is given. Raises InputError where it was not recorded."""
        if role not in self.channels:
            raise InputError(f"{self.name}: there is no channel {role!r}; it has {', '.join(self.channels)}")
        axis, channel = axis_or_new(axis), self.channels[role]
        axis.plot(channel.time, channel.value, linewidth=1.0, label=f"{self.name}: {role}")
        axis.set(xlabel="time [s]", ylabel=f"{role} [{channel.unit.replace('*', '·')}]")
        axis.margins(x=0.01)
        return axis

    def cut(self, start: float, end: float) -> "Record":
        """The part with start <= time < end [s]; for a held input including the value in force at the start.

        Raises InputError when fewer than 8 samples of the output, or none of another channel, are left.
        """
        if start >= end:
            raise InputError(f"{self.name}: use: [{start:g}, {end:g}] s: the start is not before the end")
        parts: dict[str, Channel] = {}
        for role, channel in self.channels.items():
            first, last = np.searchsorted(channel.time, [start - SAME, end - SAME])
            if role == "input" and self.hold == "zero" and first > 0 and (
                first == len(channel) or channel.time[first] > start + SAME
            ):  # fmt: skip
                first -= 1
            parts[role] = replace(channel, time=channel.time[first:last], value=channel.value[first:last])
            if len(parts[role]) < (FEWEST_COMMON_SAMPLES if role == "output" else 1):
                raise InputError(
                    f"{self.name}: {role} has {len(parts[role])} samples within use: [{start:g}, {end:g}] s; "
                    f"it lasts from {channel.time[0]:g} to {channel.time[-1]:g} s"
                )
        return replace(self, **parts)

    def uniform(self, rate: float | None = None) -> Uniform:
        """All channels on one grid over the time that they have in common.

        The rate [Hz] is that of the output unless given. The grid passes through the samples of the most important
        channel that is evenly spaced. Samples on the grid (within 1 ns) are copied. Between samples the input and
        reference follow their hold, other channels a cubic spline. No low-pass filter is applied before a lower
        rate. A formula for the forcing is evaluated. Raises InputError when the channels have too little time in common.
        """
        if rate is not None and not (np.isfinite(rate) and rate > 0.0):
            raise InputError(f"{self.name}: a rate of {rate} Hz is impossible")
        period = 1.0 / rate if rate is not None else self.output.period
        channels = self.channels
        if self.forcing_law is not None:
            channels.pop("forcing", None)
        start = max(channel.time[0] for channel in channels.values())
        end = min(self._last(role, channel) for role, channel in channels.items())
        anchor = next((c.time[0] for role in ("output", "input", "forcing") if (c := channels.get(role)) is not None
                       and _on_grid(c.time, c.time[0], period).all()), self.output.time[0])  # fmt: skip
        low = int(np.ceil((start - anchor - SAME) / period))
        high = int(np.floor((end - anchor + SAME) / period))
        if high - low + 1 < FEWEST_COMMON_SAMPLES:
            spans = ", ".join(f"{role} {c.time[0]:.6g} to {c.time[-1]:.6g} s" for role, c in channels.items())
            raise InputError(
                f"{self.name}: the channels have less than {FEWEST_COMMON_SAMPLES} samples in common ({spans})"
            )
        grid = anchor + np.arange(low, high + 1) * period
        values = {role: self._resample(role, channel, grid) for role, channel in channels.items()}
        if self.forcing_law is not None:
            values["forcing"] = self.forcing_law(grid)
        valid, missing = np.ones(len(grid), dtype=bool), np.zeros(len(grid), dtype=bool)
        for role, channel in channels.items():
            within, untold = _within_gap(channel, grid, _held(role, self.hold))
            valid, missing = valid & ~untold, missing | within
        return Uniform(grid, values.pop("output"), period, valid, missing, **values)

    def _last(self, role: str, channel: Channel) -> float:
        """Time [s] until which the channel has a value: a held one keeps its last for one more period, a single one
        for ever."""
        return channel.time[-1] + (channel.period if _held(role, self.hold) else 0.0)

    def _resample(self, role: str, channel: Channel, grid: Array) -> Array:
        time, value = channel.time, channel.value
        if _held(role, self.hold):
            return value[np.searchsorted(time, grid + SAME, side="right") - 1]
        nearest = np.clip(np.searchsorted(time, grid - SAME), 0, len(time) - 1)
        hit = np.abs(time[nearest] - grid) <= SAME
        result = value[nearest]
        if hit.all():
            return result
        if role == "input":
            if self.hold == "band_limited" and not _on_grid(time, time[0], channel.period).all():
                raise InputError(
                    f"{self.name}: input is not evenly spaced, which hold: band_limited needs; use linear"
                )
            between = continuous(time, value, self.hold)
        else:
            apart = np.concatenate([[True], np.diff(time) >= LEAST_STEP_IN_PERIODS * channel.period])
            if apart.sum() < 4:
                raise InputError(f"{self.name}: {role} has only {apart.sum()} samples to interpolate between")
            between = CubicSpline(time[apart], value[apart])
        result[~hit] = between(grid[~hit])
        return result


def _held(role: str, hold: Hold) -> bool:
    """Whether a channel keeps each value until the next one."""
    return (role == "input" and hold == "zero") or role == "reference"


def _on_grid(time: Array, anchor: float, period: float) -> NDArray[np.bool_]:
    return np.abs(time - anchor - np.rint((time - anchor) / period) * period) <= SAME


def _within_gap(channel: Channel, grid: Array, held: bool) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks of grid times within a gap of the channel, and within a gap that cannot be interpolated from its neighbours.

    A sample is valid within half a period of its time, a `held` value for a whole period after it. So a gap is as
    many periods long as samples are lost, and a sample between two gaps separates them wherever the grid lies. A
    gap can be interpolated where a cubic through its neighbours is nearly as accurate as the samples themselves,
    and where a held value is the same before and after.
    """
    missing, untold = np.zeros(len(grid), dtype=bool), np.zeros(len(grid), dtype=bool)
    first, lost = gaps_between(channel.time)
    if held:
        changed = channel.value[first] != channel.value[first + 1]
        first, lost = first[changed], lost[changed]
    if len(first) == 0:
        return missing, untold
    after, before = (channel.period - SAME, SAME) if held else (0.5 * channel.period + SAME,) * 2
    error_of_one, *errors = interpolation_errors(channel.value, np.append(1, lost))
    for at, error in zip(first, errors, strict=True):
        within = (grid > channel.time[at] + after) & (grid < channel.time[at + 1] - before)
        missing |= within
        if error > AS_GOOD * error_of_one:
            untold |= within
    return missing, untold
