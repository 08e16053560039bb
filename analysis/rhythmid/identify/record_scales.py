"""Scales of the records: size and speed of the motion, and the driving signals. They scale first guesses of
parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from rhythmid.elements.element import OFTEN_ENOUGH, Scales
from rhythmid.identify.drive_changes import most_repeated
from rhythmid.identify.series import Series, displacement, dominant_frequency, record_of
from rhythmid.identify.swing_frequency import swing_frequencies
from rhythmid.model import Model
from rhythmid.record.back_and_forth import some_record_comes_back
from rhythmid.record.pressed import some_part_is_pressed

Array = NDArray[np.float64]
REST_LENGTH = "linear_spring.rest_length"
# parts of a record whose mean speeds show whether it only rises or only falls, and the share of their range by which noise may turn it
PARTS, TURNED = 50, 0.05
NO_SPRING = 1e-4  # share of the inertia's stiffness m ω² below which a spring sets no scale


def scales(series: Sequence[Series], model: Model) -> Scales:
    """Scales that the records show, for first guesses of parameters."""
    biggest = max(series, key=lambda s: float(np.std(s.averaged)))
    frequency = dominant_frequency(biggest)
    motions = [_motion(one) for one in series]
    places = [_place(one, x) for one, (x, _) in zip(series, motions)]
    position = max(max(float(np.std(x)) for x, _ in motions), 1e-12)
    velocity = max(float(np.std(v)) for _, v in motions)
    inertial = model.mass.value * (2 * np.pi * frequency) ** 2
    spring = model.borrowed("linear_spring.stiffness", 0.0) or 0.0
    stiffness = spring if spring > NO_SPRING * inertial else inertial
    drive = _drive(series, model)
    return Scales(
        position=position,
        velocity=max(velocity, 1e-12),
        effort=drive.effort or stiffness * position,
        centre=float(np.mean(np.concatenate(places))),
        low=min(float(x.min()) for x in places),
        high=max(float(x.max()) for x in places),
        mass=model.mass.value,
        stiffness=float(stiffness),
        frequency=frequency,
        duration=max(float(s.time[-1] - s.time[0]) for s in series),
        period=biggest.period,
        forcing_frequency=_forcing_frequency(series),
        reference=drive.reference,
        peak_effort=drive.peak,
        rest=None if REST_LENGTH in model.free else model.borrowed(REST_LENGTH, 0.0),
        displaced_base=any(one.kind == "base_displacement" for one in series),
        idle=not drive.acts,
        changes=_changes(series, model),
        swings=(0.0, 0.0) if drive.acts else swing_frequencies(series),
        comes_back=some_record_comes_back((record_of(one), place) for one, place in zip(series, places)),
        pressed=some_part_is_pressed((x, v, one.average(one.drive)) for one, (x, v) in zip(series, motions)),
        once=all(_once(v) for _, v in motions),
        signal=_signal(series),
    )


@dataclass(frozen=True)
class _Drive:
    """Sizes of the driving signals: rms and largest value of the recorded force, rms of a reference; whether anything drives the machine."""

    effort: float
    peak: float
    reference: float
    acts: bool


def _drive(series: Sequence[Series], model: Model) -> _Drive:
    effort, peak, reference = 0.0, 0.0, 0.0
    # from the model's own forcing or controller
    acts = any(term.element.acts in ("drive", "feedback") for term in model.terms)
    # by a voltage, for example: the recorded signal is no force
    fed = any(term.element.takes for term in model.terms)
    drives = [one.drive for one in series]
    # windows and records may each have another level of the driving signal
    levels = [float(total[0]) for one, total in zip(series, drives) if one.kind != "base_displacement"]
    acts = acts or len(set(levels)) > 1 or any(one.driven for one in series)
    spread = float(np.std(levels)) if levels else 0.0
    for one, total in zip(series, drives):
        if one.kind == "reference":
            reference = max(reference, float(np.std(total)))
        elif not fed:
            effort = max(effort, float(np.std(total)), spread)
            peak = max(peak, float(np.abs(total).max(initial=0.0)))
    return _Drive(effort, peak, reference, acts)


def _forcing_frequency(series: Sequence[Series]) -> float:
    """Strongest frequency [Hz] of the longest recorded forcing; 0 without one."""
    forced = [one for one in series if one.forcing is not None]
    if not forced:
        return 0.0
    longest = max(forced, key=lambda one: one.time[-1] - one.time[0])
    assert longest.forcing is not None
    return dominant_frequency(replace(longest, value=np.asarray(longest.forcing(longest.time))), finer=16)


def _once(speed: Array) -> bool:
    """Whether a speed only rises or only falls."""
    steps = np.diff([float(part.mean()) for part in np.array_split(speed, min(PARTS, len(speed)))])
    up, down = float(steps[steps > 0.0].sum()), -float(steps[steps < 0.0].sum())
    return min(up, down) <= TURNED * max(up, down)


def _signal(series: Sequence[Series]) -> tuple[float, float, float, float]:
    """Smallest, mean and largest value of the measurement in all series, and its largest standard deviation in one."""
    every = np.concatenate([one.averaged for one in series])
    spread = max(float(np.std(one.averaged)) for one in series)
    return float(every.min()), float(every.mean()), float(every.max()), max(spread, 1e-12)


def _changes(series: Sequence[Series], model: Model) -> int:
    """Times at which the drive does the same in one record, at most `OFTEN_ENOUGH`; the model's own forcing does it often."""
    if any(term.element.acts == "drive" for term in model.terms):
        return OFTEN_ENOUGH
    found = [
        most_repeated((record_of(one), *one.channels[number]) for one in series)
        for number in range(len(series[0].channels))
    ]
    return min(max(found), OFTEN_ENOUGH)


def _place(series: Series, motion: Array) -> Array:
    """Position (blocks,) in the model's coordinates: that of `motion`, or relative to the model's initial position
    where only the speed is measured."""
    fixed = series.kind == "base_displacement" or series.measured != "velocity"
    return motion if fixed else series.average(displacement(series))


def _motion(series: Series) -> tuple[Array, Array]:
    """Approximate position and velocity (blocks,) each, as the model's force elements see them.

    They are relative to a moving base. A quantity that is not measured is integrated, with its mean set to zero.
    """
    step, value = series.period * series.block, series.averaged
    if series.kind == "base_displacement" and series.command is not None and series.measured == "position":
        value = value - series.command(series.centres)
    for _ in range({"position": 0, "velocity": 1, "acceleration": 2}[series.measured]):
        value = value - value.mean()
        value = cumulative_trapezoid(value, dx=step, initial=0.0)
    if series.measured == "velocity":
        return value, series.averaged
    return value, np.gradient(value, step) if len(value) > 2 else np.zeros_like(value)
