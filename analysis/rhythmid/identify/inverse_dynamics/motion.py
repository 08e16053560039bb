"""The measured motion as inverse dynamics needs it: position, velocity and acceleration, and the effort that made it.

This is the one place where irregular stamps are put on a uniform grid (a cubic spline through the samples, `Record.uniform`):
zero-phase filters need one. Low-pass in both directions, then the derivatives of cubic splines, which unlike central
differences keep a motion of a tenth of the sample rate to a few thousandths.
M. Gautier, A. Janot, P. O. Vandanjon, IEEE Trans. Control Syst. Technol. 21 (2013) 428 (IDIM-LS and its filters).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from rhythmid.errors import InputError
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.reference_path import Reference
from rhythmid.identify.noise import runs
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
ORDER = 4  # of the Butterworth filter, run forwards and backwards (the order that Gautier et al. use)
SLOW_ORDER = 2  # of the high-pass filter, run twice
FINER = 10.0  # samples in a period of the motion's bandwidth that are kept: the switch of a friction is placed to a tenth of it
FEWEST_STRETCH_SAMPLES = 32  # samples of a stretch without a gap, below which it says nothing
BRIDGE = 3  # degree of the polynomial across a gap: it turns once on either side, as what the band holds may within three gaps
LEAST_BESIDE = (
    4  # samples on either side of a gap that it is fitted to, at least, and as many more as are missing
)
BASES = ("base_displacement", "base_acceleration")


@dataclass(frozen=True, eq=False)
class Motion:
    """One stretch of a record without a gap, on a uniform grid; arrays (n,) in the model's units.

    `record` numbers the record. `effort` is the total force that was recorded; of a machine that its base drives it is
    d'Alembert's −m a, and `driven_by_base` says so. `leg_position`, `leg_velocity` are relative to the base where that
    moves. `coupling` (n,) is, at a joint of several, the force beside its own inertia times its acceleration that the body asks
    for; `links` are its derivatives with respect to the body's parameters, by name, and the values at which they were taken.
    `bridged` are the gaps, from and until [s], across which nothing was recorded but interpolated: no row of effort lies there. `others`
    are the speeds of the other joints, by name. Where the effort was not recorded, `reference` is what a controller makes it of.
    """

    record: int
    name: str
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    leg_position: Array
    leg_velocity: Array
    effort: Array
    period: float
    driven_by_base: bool = False
    coupling: Array | None = None
    links: Mapping[str, tuple[float, Array]] = field(default_factory=dict)
    bridged: tuple[tuple[float, float], ...] = ()
    others: Mapping[str, Array] = field(default_factory=dict)
    reference: Reference | None = None

    def recorded(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Those of the rows that lie in no gap."""
        time = self.time[rows]
        for begin, end in self.bridged:
            rows, time = rows[(time <= begin) | (time >= end)], time[(time <= begin) | (time >= end)]
        return rows

    def path(self, effort: Array, leg: Array, signal: Array, of_leg: bool) -> Path:
        """The trajectory along which an element's force is computed."""
        position, velocity = (
            (self.leg_position, self.leg_velocity) if of_leg else (self.position, self.velocity)
        )
        load = None if self.coupling is None else -self.coupling
        acceleration = self.acceleration if velocity is self.velocity else None
        return Path(self.time, position, velocity, effort, leg, signal, load, acceleration)


@dataclass(frozen=True, eq=False)
class Stretch:
    """Raw samples (n,) of one stretch: the measured output, the effort or base signal, and the forcing, on a grid; `bridged` are
    the gaps, from and until [s], across which they were interpolated."""

    record: int
    name: str
    time: Array
    output: Array
    drive: Array
    period: float
    kind: str
    measured: str
    bridged: tuple[tuple[float, float], ...] = ()


def effort_channel(record: Record, model: Model) -> Channel | None:
    """The channel that holds the effort: what was recorded of the motor, else the commanded force; None where there is none."""
    if record.effort is not None:
        return record.effort
    if record.input is not None and record.input_kind == "force" and not controlled(model):
        return record.input
    return None


def stretches(records: Sequence[Record], model: Model, longest: float = 0.0) -> list[Stretch]:
    """The stretches without gaps of all records, on uniform grids at the rates of their outputs; gaps of up to `longest` [s],
    and those that their neighbours tell, are bridged.

    Raises InputError where a record has neither effort nor a moving base, or is too short.
    """
    found: list[Stretch] = []
    number, before = -1, ""
    for record in records:
        number += not record.whole or record.whole != before  # stretches of one record have one number
        before = record.whole
        base = record.input is not None and record.input_kind in BASES
        effort = effort_channel(record, model)
        if effort is None and not base:
            raise InputError(f"{record.name}: neither an effort nor the motion of its base was recorded")
        grid = replace(record, reference=None).uniform()
        if base:
            assert record.input is not None
            drive = _spline(record.input)(grid.time)
        elif record.effort is not None:
            assert grid.effort is not None
            drive = grid.effort
        else:
            assert grid.input is not None and record.input is not None
            held = record.hold == "zero"
            drive = _mean_held(record.input, grid.time, grid.period) if held else grid.input
            drive = drive if grid.forcing is None else drive + grid.forcing
        short = short_gaps(grid.missing, int(longest / grid.period))
        bridged = short | (
            grid.missing & grid.valid
        )  # where the neighbours tell a gap, the grid has its values
        output, drive = (across(signal, ~grid.missing, short) for signal in (grid.output, drive))
        for joined in runs(~grid.missing | bridged):
            measured = joined.start + np.flatnonzero(~grid.missing[joined])
            if not len(measured):
                continue
            first, end = (
                int(measured[0]),
                int(measured[-1]) + 1,
            )  # beyond the last sample there is nothing to bridge to
            if end - first < FEWEST_STRETCH_SAMPLES:
                continue
            part = slice(first, end)
            spans = ((first + gap.start - 1, first + gap.stop) for gap in runs(bridged[part]))
            kind = record.input_kind if base else "force"
            found.append(
                Stretch(
                    number, record.name, grid.time[part], output[part], drive[part], grid.period, kind,
                    record.output_kind, tuple((float(grid.time[a]), float(grid.time[b])) for a, b in spans),
                )
            )  # fmt: skip
    if not found:
        raise InputError(f"no stretch without a gap has {FEWEST_STRETCH_SAMPLES} samples")
    return found


def short_gaps(missing: Mask, longest: int) -> Mask:
    """Samples (n,) in gaps of at most so many samples, with at least four recorded ones near either side."""
    found = np.zeros(len(missing), dtype=bool)
    for gap in runs(missing):
        first, end = gap.start, gap.stop
        beside = max(end - first, LEAST_BESIDE)
        before, after = ~missing[max(first - beside, 0) : first], ~missing[end : end + beside]
        if end - first <= longest and min(before.sum(), after.sum()) >= LEAST_BESIDE:
            found[first:end] = True
    return found


def across(signal: Array, recorded: Mask, bridged: Mask) -> Array:
    """A signal (n,) with its `bridged` runs on the polynomial through what is recorded on either side, by least squares: a spline
    through noisy samples would set out with the slope of their noise."""
    made = signal.copy()
    for gap in runs(bridged):
        first, end = gap.start, gap.stop
        beside = max(end - first, LEAST_BESIDE)
        near = np.arange(max(first - beside, 0), min(end + beside, len(signal)))
        near = near[recorded[near]]
        if len(near) <= BRIDGE:
            continue  # what the spline made of it
        through = Polynomial.fit(near.astype(float), signal[near], BRIDGE)
        made[first:end] = through(np.arange(first, end, dtype=float))
    return made


@lru_cache(maxsize=64)
def _sections(order: int, cut: float, kind: str) -> Array:
    """Second-order sections of a Butterworth filter; `cut` as a share of the Nyquist frequency."""
    return np.atleast_2d(np.asarray(butter(order, cut, btype=kind, output="sos")))  # pyright: ignore[reportArgumentType]


def low_pass(values: Array, period: float, frequency: float) -> Array:
    """Values (n,) or (n, p) without what is above the frequency [Hz]: a Butterworth filter in both directions."""
    if frequency * period >= 0.45:
        return values
    sections = _sections(ORDER, 2.0 * frequency * period, "lowpass")
    padding = min(len(values) - 1, max(3 * (2 * len(sections) + 1), math.ceil(1.5 / (frequency * period))))
    return sosfiltfilt(sections, values, axis=0, padlen=padding)


def high_pass(values: Array, period: float, frequency: float) -> Array:
    """Values (n,) or (n, p) without what is below the frequency [Hz], in both directions; all of them where it is 0."""
    if frequency <= 0.0:
        return values
    sections = _sections(SLOW_ORDER, 2.0 * frequency * period, "highpass")
    padding = min(len(values) - 1, math.ceil(1.0 / (frequency * period)))
    return sosfiltfilt(sections, values, axis=0, padlen=padding)


def motion_of(stretch: Stretch, model: Model, frequency: float, low: float = 0.0) -> Motion:
    """The motion below `frequency` [Hz] of one stretch, on a grid as coarse as that allows.

    What the model's sensor does to the measurement is taken back to first order. A velocity is integrated to a position whose
    mean is zero, an acceleration to a motion above `low` [Hz]: an accelerometer's drift would be all that is seen below.
    """
    time, period = stretch.time, stretch.period
    coarser = max(1, int(1.0 / (FINER * frequency * period)))
    output = _before_sensor(stretch, model)
    drive = low_pass(stretch.drive, period, frequency)[::coarser]
    smooth = low_pass(output, period, frequency)[::coarser]
    time, period = time[::coarser], period * coarser
    base = base_rate = base_acceleration = np.zeros(len(time))
    if stretch.kind == "base_displacement":
        base, base_rate, base_acceleration = _derivatives(time, drive)
    elif stretch.kind == "base_acceleration":
        base_acceleration = drive
    relative = (
        stretch.kind == "base_acceleration"
    )  # then the motion is the leg's, and the mass moves with the base besides
    if stretch.measured == "position":
        position, velocity, acceleration = _derivatives(time, smooth)
    elif stretch.measured == "velocity":
        velocity = smooth
        acceleration = CubicSpline(time, smooth).derivative()(time)
        position = CubicSpline(time, smooth).antiderivative()(time)
        position = position - position.mean()
    else:
        acceleration = high_pass(smooth - base_acceleration if relative else smooth, period, low)
        velocity = high_pass(_integral(time, acceleration), period, low)
        position = high_pass(_integral(time, velocity), period, low)
    inertial = model.mass.value * (acceleration + (base_acceleration if relative else 0.0))
    moved = stretch.kind == "base_displacement"
    if (
        moved and stretch.measured == "acceleration"
    ):  # the base's slow motion, too, is unknown to the accelerometer
        base, base_rate = high_pass(base, period, low), high_pass(base_rate, period, low)
    return Motion(
        stretch.record, stretch.name, time, position, velocity, acceleration,
        position - base if moved else position,
        velocity - base_rate if moved else velocity,
        drive if stretch.kind == "force" else -inertial,
        period, stretch.kind in BASES,
        bridged=stretch.bridged,
    )  # fmt: skip


def _derivatives(time: Array, value: Array) -> tuple[Array, Array, Array]:
    """A smooth signal (n,) with its first and second derivative."""
    rate = CubicSpline(time, value).derivative()(time)
    return value, rate, CubicSpline(time, rate).derivative()(time)


def _integral(time: Array, value: Array) -> Array:
    """Integral (n,) of a signal whose mean is taken for an offset, with mean zero."""
    total = CubicSpline(time, value - value.mean()).antiderivative()(time)
    return total - total.mean()


def _before_sensor(stretch: Stretch, model: Model) -> Array:
    """The measured output with what the model's sensor elements add to it taken away, to first order."""
    output = stretch.output
    for term in model.terms:
        if term.element.slot == "sensor" and term.element.kernel is not None:
            zero = np.zeros(len(output))
            path = Path(stretch.time, output, zero, zero, zero, output)
            values = term.numbers
            output = output - effect_along(term.element, values, model, path)
    return output


def _mean_held(channel: Channel, time: Array, period: float) -> Array:
    """Mean (n,) of a held effort over a period about each time: what the machine answers to. The value at the time itself would be one
    hold older or younger as the stamps happen to jitter about the grid."""
    ends = np.array([min(channel.time[0], time[0]) - period, max(channel.time[-1], time[-1]) + period])
    knots = np.concatenate([ends[:1], channel.time[1:], ends[1:]])  # before the first sample it was as there
    impulse = np.concatenate([[0.0], np.cumsum(channel.value * np.diff(knots))])
    first, last = (np.interp(time + side * period, knots, impulse) for side in (-0.5, 0.5))
    return (last - first) / period


def _spline(channel: Channel) -> CubicSpline:
    apart = np.concatenate([[True], np.diff(channel.time) > 0.0])
    return CubicSpline(channel.time[apart], channel.value[apart])
