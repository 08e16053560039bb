"""Standstill: an output that moves by no more than its rounding or noise, so that it contains no information about
the machine.

Noise has a short memory, is stationary, and is uncorrelated with the driving signals. Its memory is that of the
sensor: drivers average or hold a few samples. The autocorrelation of a motion lasts longer, however small the
motion is relative to the noise. At a large lag it is the motion's share of the variance [Box, Jenkins and Reinsel,
Time Series Analysis, ch. 2]. The standard deviation of a correlation of two such signals is Bartlett's (ibid., ch.
12).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate
from scipy.stats import norm

from rhythmid.record.outlier import USUAL
from rhythmid.record.record import Record
from rhythmid.record.rounding import resolution

Array = NDArray[np.float64]
DRIVES = ("input", "effort", "forcing", "reference")  # roles of channels that drive a machine
LEAST_SAMPLES = 200  # with fewer samples an autocorrelation of 0.2 is within chance
SHARE = 0.2  # share of the variance up to which a lasting part is no motion: it is half the size of the noise
FLICKER = 3  # number of distinct values up to which the sensor shows its own resolution and no motion
# share of the samples up to which a value is an exception, such as a flipped bit, and no motion
RARELY = 0.01
FEW_STEPS = 16  # range in steps of the resolution up to which a motion is of the size of the rounding
# samples that a driver may average or hold; a longer memory is the machine's, for a motion of that size
AVERAGED = 8
WHITE = 2  # the same for a larger motion, whose memory may be that of a well-damped machine
CREST = 8.0  # standard deviations above which a single move is an event and no noise
CHANCE = 1e-3  # significance level for a correlation of noise with a driving signal


def standstill(record: Record, buried: bool = True) -> str | None:
    """Reason why the machine of this record is considered at rest, in one sentence with advice; None where it
    moves, or where there are too few samples.

    With `buried` False, an output whose noise exceeds the rounding counts as a motion, because it may contain a
    small one. Outliers look like events, so the record should be `cleaned`.
    """
    value = record.output.value
    if np.ptp(value) == 0.0 and is_driven(record):
        return _held(record)
    if len(value) < LEAST_SAMPLES or not np.all(np.isfinite(value)):
        return None
    span, step = float(np.ptp(value)), resolution(value)
    size = f"its {record.output_kind} moves by {span:.3g} {record.output.unit} in all"
    levels, count = np.unique(value, return_counts=True)
    if len(levels) <= FLICKER:
        return _sentence(_flicker(levels, count, record))
    small = step > 0.0 and span <= FEW_STEPS * step
    if (
        not (small or buried)
        or not _noise(value, step, AVERAGED if small else WHITE)
        or _goes_with_drive(record)
    ):
        return None
    if small:
        return _sentence(f"{size}, {span / step:.0f} steps of its resolution, as noise does that is rounded")
    return _sentence(f"{size}, no different from white noise")


def is_driven(record: Record) -> bool:
    """Whether a force, or a change of the command, drives the machine of a record."""
    return _driver(record) != ""


def _driver(record: Record) -> str:
    """Role of the channel that drives the machine; empty where there is none."""
    for role in DRIVES:
        channel = record.channels.get(role)
        if channel is None or not np.isfinite(channel.value).all():
            continue
        of_force = role in ("effort", "forcing") or (role == "input" and record.input_kind == "force")
        if np.any(channel.value != 0.0) if of_force else np.ptp(channel.value) > 0.0:
            return role
    return ""


def _held(record: Record) -> str:
    """Message about a driven machine that never moves: no motion, but the force that does not yet start one."""
    role = _driver(record)
    channel = record.channels[role]
    unit = "" if channel.unit == "1" else f" {channel.unit}"
    size = f"{float(np.abs(channel.value).max()):.4g}{unit}"
    return (
        f"the machine stands still: its {record.output_kind} never changes, though the {role} reaches {size}: static friction, a dead band "
        "or a stop holds it, or its sensor failed; give records in which it moves"
    )


def _flicker(levels: Array, count: NDArray[np.int64], record: Record) -> str:
    """Message about an output with a few values, `count` of each: based on the values that are no exceptions."""
    what, unit = record.output_kind, record.output.unit
    often = count > RARELY * count.sum()
    rare = ", ".join(f"{one:.6g}" for one in levels[~often])
    but = f" but for {count[~often].sum()} of {count.sum()} samples ({rare})" if rare else ""
    if often.sum() == 1:
        return f"its {what} never changes{but}"
    span = float(np.ptp(levels[often]))
    return f"its {what} moves by {span:.3g} {unit} in all{but}, between {often.sum()} values that its sensor shows side by side"


def _sentence(why: str) -> str:
    return (
        f"the machine stands still: {why}; record it while it moves, or choose a channel that shows a motion"
    )


def _noise(value: Array, step: float, memory: int) -> bool:
    """Whether values (n,) are stationary noise with a memory of at most `memory` samples."""
    away = np.abs(value - np.median(value))
    if away.max() > CREST * max(USUAL * float(np.median(away)), step):
        return False
    return bool(np.abs(_correlation(value, value)[memory:]).max() <= SHARE)


def _goes_with_drive(record: Record) -> bool:
    """Whether the output is significantly correlated with a channel that drives the machine."""
    time, value = record.output.time, record.output.value
    own = _correlation(value, value)
    for role, channel in record.channels.items():
        if role in ("output", "velocity") or np.ptp(channel.value) == 0.0:
            continue
        drive = np.interp(time, channel.time, channel.value)
        if np.ptp(drive) == 0.0:
            continue
        drives = _correlation(drive, drive)
        spread = np.sqrt(max(1.0 + 2.0 * float(own[1:AVERAGED] @ drives[1:AVERAGED]), 1.0) / len(value))
        found = np.abs(_correlation(drive, value))
        if found.max() > float(norm.isf(0.5 * CHANCE / len(found))) * spread:
            return True
    return False


def _correlation(first: Array, second: Array) -> Array:
    """Correlation (n // 2,) of two signals (n,) by the lag of the second in samples."""
    n = len(first)
    a, b = (one - one.mean() for one in (first, second))
    found = correlate(b, a, mode="full", method="fft")[n - 1 : n - 1 + n // 2]
    return found / (n * float(np.std(a)) * float(np.std(b)))
