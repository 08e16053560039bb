"""Gaps: missing samples of a channel. They are interpolated where possible; otherwise the record is cut there.

A missing measurement is not compared, with no further effect. A missing command acted on the machine nevertheless.
Where neither its neighbours nor its periodicity determine it, the record is cut and continues with a new initial
state.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.ends import acts_always, within_samples_of
from rhythmid.record.fourier_series import periodic
from rhythmid.record.interpolation import cubic, interpolation_errors
from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import gaps_between
from rhythmid.record.tolerable import tolerable_error

Array = NDArray[np.float64]
# [s] of a command that must be known before the first measurement after a gap: its delay may be as long
PAST = 0.05
LEAST_SAMPLES = 32  # least measurements in a stretch: with fewer, its initial state absorbs all information


@dataclass(frozen=True)
class Cut:
    """The stretches of a record between the `gaps` of its commands, from and until [s], and messages about them.

    `whole` is the uncut record with short gaps filled; `filled` are the notes that also apply to it.
    """

    stretches: tuple[Record, ...]
    notes: tuple[str, ...]
    whole: Record
    filled: tuple[str, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()


def cut_at_gaps(record: Record) -> Cut:
    """The record with short gaps of its commands filled, cut at the long ones.

    A gap is short where a cubic through its neighbours, or the Fourier series of a periodic command, is accurate
    enough: the resulting error of the motion is below the measurement noise. The accuracy is measured where no
    sample is missing. A held command with the same value before and after a gap is not missing. The stretches have
    the record's name with their start time. Measurements outside the samples of a force that also acted then are
    left out (`ends`).
    """
    notes: list[str] = []
    spans: list[tuple[float, float]] = []
    for role in ("input", "forcing"):
        channel: Channel | None = getattr(record, role)
        if channel is None or len(channel) < 8 or (role == "forcing" and record.forcing_law is not None):
            continue
        if acts_always(record, role):
            record, left_out = within_samples_of(record, role, LEAST_SAMPLES)
            if left_out > 0.0:
                first, last = channel.time[0], channel.time[-1]
                notes.append(
                    f"{record.name}: the {role} is recorded from {first:.6g} to {last:.6g} s only: {left_out:.3g} s of the output are left out"
                )
            channel = record.channels[role]
        held = role == "input" and record.hold == "zero"
        filled, count, open_ = _bridged(channel, record.output, held)
        spans += open_
        if count:
            record = replace(record, **{role: filled})
            notes.append(f"{record.name}: {count} lost samples of the {role} are interpolated")
    filled_in = tuple(notes)
    if not spans:
        return Cut((record,), filled_in, record, filled_in)
    stretches = tuple(_between(record, _joined(spans)))
    if not stretches:
        return Cut((record,), filled_in, record, filled_in)  # too many gaps to cut: the hold is used
    kept = sum(one.duration for one in stretches)
    gaps = tuple(_joined(spans))
    notes.append(
        f"{record.name}: cut where commands are missing ({len(gaps)} times, the first at t = {gaps[0][0]:.6g} s, "
        f"{sum(b - a for a, b in gaps):.3g} s in all) into stretches with initial states of their own ({len(stretches)}, {kept:.4g} s)"
    )
    return Cut(stretches, tuple(notes), record, filled_in, gaps)


def _bridged(channel: Channel, output: Channel, held: bool) -> tuple[Channel, int, list[tuple[float, float]]]:
    """The channel with its short gaps filled, the number of samples filled in, and the long gaps, from and until [s]."""
    time, value = channel.time, channel.value
    first, lost = gaps_between(time)
    if held:
        changed = value[first] != value[first + 1]
        first, lost = first[changed], lost[changed]
    if len(first) == 0:
        return channel, 0, []
    tolerable = tolerable_error(output)
    spread = max(float(np.std(value)), 1e-300)
    errors = interpolation_errors(value, lost)
    law = None if held else periodic(channel.time, channel.value)
    left = np.inf if law is None else law.left
    told = np.minimum(errors, left) / spread * lost * channel.period < tolerable
    told &= lost <= len(value)  # a gap that is longer than the recorded part cannot be filled from it
    stamps, values = [time], [value]
    for at, count, error in zip(first[told], lost[told], errors[told]):
        between = time[at] + (time[at + 1] - time[at]) * np.arange(1, count + 1) / (count + 1)
        near = slice(max(at - 1, 0), at + 3)
        stamps.append(between)
        if law is None or error <= law.left:
            values.append(cubic(time[near], value[near], between))
        else:
            values.append(law(between))
    open_ = [(float(time[at]), float(time[at + 1])) for at in first[~told]]
    every = np.concatenate(stamps)
    order = np.argsort(every, kind="stable")
    filled = replace(channel, time=every[order], value=np.concatenate(values)[order])
    return filled, int(lost[told].sum()), open_


def _joined(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Overlapping spans merged, in order."""
    found: list[tuple[float, float]] = []
    for begin, end in sorted(spans):
        if found and begin <= found[-1][1]:
            found[-1] = found[-1][0], max(end, found[-1][1])
        else:
            found.append((begin, end))
    return found


def _between(record: Record, spans: list[tuple[float, float]]) -> Iterable[Record]:
    """The stretches of a record between these spans that are long enough."""
    time = record.output.time
    begins = [-np.inf, *(end for _, end in spans)]
    ends = [*(begin for begin, _ in spans), np.inf]
    for begin, end in zip(begins, ends, strict=True):
        past = min(PAST, 0.25 * (min(end, time[-1]) - begin)) if np.isfinite(begin) else 0.0
        inside = (time >= begin + past) & (time <= end)
        if np.count_nonzero(inside) < LEAST_SAMPLES:
            continue
        parts = {role: _part(channel, begin, end) for role, channel in record.channels.items()}
        parts["output"] = replace(
            record.output, time=record.output.time[inside], value=record.output.value[inside]
        )
        if any(len(channel) == 0 for channel in parts.values()):
            continue
        name = f"{record.name}@{parts['output'].time[0]:.2f}s"
        yield replace(record, name=name, whole=record.whole or record.name, **parts)


def _part(channel: Channel, begin: float, end: float) -> Channel:
    inside = (channel.time >= begin) & (channel.time <= end)
    return replace(channel, time=channel.time[inside], value=channel.value[inside])
