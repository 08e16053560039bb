"""The measured motion for inverse dynamics: position, velocity, acceleration, and the effort that caused it.

Only here are irregular timestamps resampled to a uniform grid (a cubic spline through the samples,
`Record.uniform`), because zero-phase filters need one. The signals pass a low-pass filter in both directions. Then
cubic splines are differentiated. Unlike central differences, their derivatives are accurate to a few thousandths
for motions up to a tenth of the sample rate. M. Gautier, A. Janot, P. O. Vandanjon, IEEE Trans. Control Syst.
Technol. 21 (2013) 428 (IDIM-LS and its filters).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfilt, sosfilt_zi

from rhythmid.errors import InputError
from rhythmid.identify.drive import controlled
from rhythmid.identify.inverse_dynamics.reference_path import Reference
from rhythmid.identify.noise import runs
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.effect import Path, effect_along

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
ORDER = 4  # order of the Butterworth filter, run forwards and backwards (as Gautier et al.)
SLOW_ORDER = 2  # order of the high-pass filter, run in both directions
# samples kept per period of the motion's bandwidth: a friction reversal is located to a tenth of the period
FINER = 10.0
FEWEST_STRETCH_SAMPLES = 32  # least number of samples of a stretch without gaps
# degree of the polynomial across a gap: one turning point on either side, as many as the bandwidth allows within
# three gaps
BRIDGE = 3
# least number of samples on either side of a gap for the polynomial; the number of missing samples is added
LEAST_BESIDE = 4
BASES = ("base_displacement", "base_acceleration")


@dataclass(frozen=True, eq=False)
class Motion:
    """One stretch of a record without gaps, on a uniform grid; arrays (n,) in the model's units.

    `record` is the number of the record. `effort` is the recorded total force. For a machine that is driven by its
    base it is d'Alembert's −m a, and `driven_by_base` is True. `leg_position`, `leg_velocity` are relative to a
    moving base. `coupling` (n,) is used for a joint of several: the force that the body requires besides the
    joint's own inertia times its acceleration. `links` holds its derivatives with respect to the body's parameters,
    by name, with the values at which they were taken. `bridged` holds the gaps, from and until [s], that were
    interpolated; they contain no rows of effort. `others` holds the speeds of the other joints, by name. Where the
    effort was not recorded, `reference` is the reference from which a controller computes it.
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
        """Those of the `rows` that lie in no gap."""
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
    """Raw samples (n,) of one stretch on a uniform grid: the measured output, the effort or base signal, and the
    forcing. `bridged` holds the interpolated gaps, from and until [s]."""

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
    """The channel with the effort: the recorded motor effort, else the commanded force; None where there is neither."""
    if record.effort is not None:
        return record.effort
    if record.input is not None and record.input_kind == "force" and not controlled(model):
        return record.input
    return None


def stretches(records: Sequence[Record], model: Model, longest: float = 0.0) -> list[Stretch]:
    """The stretches without gaps of all records, on uniform grids at their outputs' sample rates. Gaps of up to
    `longest` [s] are bridged, and gaps that neighbouring samples determine.

    Raises InputError where a record has neither effort nor a moving base, or is too short.
    """
    found: list[Stretch] = []
    number, before = -1, ""
    for record in records:
        number += not record.whole or record.whole != before  # stretches of one record share its number
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
        # where neighbouring samples determine a gap, the grid already has its values
        bridged = short | (grid.missing & grid.valid)
        output, drive = (across(signal, ~grid.missing, short) for signal in (grid.output, drive))
        for joined in runs(~grid.missing | bridged):
            measured = joined.start + np.flatnonzero(~grid.missing[joined])
            if not len(measured):
                continue
            first, end = (
                int(measured[0]),
                int(measured[-1]) + 1,
            )  # beyond the last sample there is no other side of the gap
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
    """Samples (n,) in gaps of at most `longest` samples with at least four recorded samples near either side."""
    found = np.zeros(len(missing), dtype=bool)
    for gap in runs(missing):
        first, end = gap.start, gap.stop
        beside = max(end - first, LEAST_BESIDE)
        before, after = ~missing[max(first - beside, 0) : first], ~missing[end : end + beside]
        if end - first <= longest and min(before.sum(), after.sum()) >= LEAST_BESIDE:
            found[first:end] = True
    return found


def across(signal: Array, recorded: Mask, bridged: Mask) -> Array:
    """A signal (n,) whose `bridged` runs are replaced by a least-squares polynomial through recorded samples on
    either side. A spline through noisy samples would start with the slope of their noise."""
    made = signal.copy()
    for gap in runs(bridged):
        first, end = gap.start, gap.stop
        beside = max(end - first, LEAST_BESIDE)
        near = np.arange(max(first - beside, 0), min(end + beside, len(signal)))
        near = near[recorded[near]]
        if len(near) <= BRIDGE:
            continue  # keep the spline's values
        through = Polynomial.fit(near.astype(float), signal[near], BRIDGE)
        made[first:end] = through(np.arange(first, end, dtype=float))
    return made


@lru_cache(maxsize=64)
def _sections(order: int, cut: float, kind: str) -> tuple[Array, Array]:
    """Second-order sections of a Butterworth filter and their states under a constant 1; `cut` as a share of the Nyquist frequency."""
    sections = np.atleast_2d(np.asarray(butter(order, cut, btype=kind, output="sos")))  # pyright: ignore[reportArgumentType]
    return sections, np.asarray(sosfilt_zi(sections))


def _both_ways(sections: Array, at_rest: Array, values: Array, padding: int) -> Array:
    """Values (n,) or (n, p) after a filter that is run forwards and backwards, as by scipy's `sosfiltfilt`, which computes the states
    `at_rest` at every call: for short signals that is most of its time."""
    begin, end = values[:1], values[-1:]
    if padding > 0:
        before, after = 2.0 * begin - values[padding:0:-1], 2.0 * end - values[-2 : -(padding + 2) : -1]
        values = np.concatenate([before, values, after])
    states = at_rest.reshape(*at_rest.shape, *(1,) * (values.ndim - 1))
    forwards = np.asarray(sosfilt(sections, values, axis=0, zi=states * values[:1])[0])
    back = np.asarray(sosfilt(sections, forwards[::-1], axis=0, zi=states * forwards[-1:])[0])[::-1]
    return back[padding:-padding] if padding > 0 else back


def low_pass(values: Array, period: float, frequency: float) -> Array:
    """Values (n,) or (n, p) after a low-pass Butterworth filter of cut-off `frequency` [Hz], run in both directions."""
    if frequency * period >= 0.45:
        return values
    sections, at_rest = _sections(ORDER, 2.0 * frequency * period, "lowpass")
    padding = min(len(values) - 1, max(3 * (2 * len(sections) + 1), math.ceil(1.5 / (frequency * period))))
    return _both_ways(sections, at_rest, values, padding)


def high_pass(values: Array, period: float, frequency: float) -> Array:
    """Values (n,) or (n, p) after a high-pass filter of cut-off `frequency` [Hz], run in both directions; unchanged
    where it is 0."""
    if frequency <= 0.0:
        return values
    sections, at_rest = _sections(SLOW_ORDER, 2.0 * frequency * period, "highpass")
    padding = min(len(values) - 1, math.ceil(1.0 / (frequency * period)))
    return _both_ways(sections, at_rest, values, padding)


def motion_of(stretch: Stretch, model: Model, frequency: float, low: float = 0.0) -> Motion:
    """The motion of one stretch below `frequency` [Hz], on a grid as coarse as that allows.

    The effect of the model's sensor elements is removed to first order. A velocity is integrated to a position of mean
    zero. An acceleration is integrated to a motion above `low` [Hz]: below, the accelerometer's drift would dominate.
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
    # the motion is then relative to the base, and the mass moves with the base as well
    relative = stretch.kind == "base_acceleration"
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
    # the accelerometer does not show the base's slow motion either
    if moved and stretch.measured == "acceleration":
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
    """A smooth signal (n,) with its first and second derivatives (n,)."""
    rate = CubicSpline(time, value).derivative()(time)
    return value, rate, CubicSpline(time, rate).derivative()(time)


def _integral(time: Array, value: Array) -> Array:
    """Integral (n,), of mean zero, of a signal whose mean is treated as an offset."""
    total = CubicSpline(time, value - value.mean()).antiderivative()(time)
    return total - total.mean()


def _before_sensor(stretch: Stretch, model: Model) -> Array:
    """The measured output (n,) without the effect of the model's sensor elements, to first order."""
    output = stretch.output
    for term in model.terms:
        if term.element.slot == "sensor" and term.element.kernel is not None:
            zero = np.zeros(len(output))
            path = Path(stretch.time, output, zero, zero, zero, output)
            values = term.numbers
            output = output - effect_along(term.element, values, model, path)
    return output


def _mean_held(channel: Channel, time: Array, period: float) -> Array:
    """Mean (n,) of a held effort over one period about each time, to which the machine responds. The value at the
    time itself could be one hold too old or too new, depending on the jitter of the timestamps."""
    ends = np.array([min(channel.time[0], time[0]) - period, max(channel.time[-1], time[-1]) + period])
    # before the first sample the first value is used
    knots = np.concatenate([ends[:1], channel.time[1:], ends[1:]])
    impulse = np.concatenate([[0.0], np.cumsum(channel.value * np.diff(knots))])
    first, last = (np.interp(time + side * period, knots, impulse) for side in (-0.5, 0.5))
    return (last - first) / period


def _spline(channel: Channel) -> CubicSpline:
    apart = np.concatenate([[True], np.diff(channel.time) > 0.0])
    return CubicSpline(channel.time[apart], channel.value[apart])
