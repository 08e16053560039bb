"""Ends of a record: measurements before the first sample of a force that acted then as well, and after the last one.

A recorder hears one topic later than another. A pump's force did not begin with the first message of it, so that a machine whose forcing
is taken for constant until then seems to lack something. What a program sends, a held command or a reference, does begin with it.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.fourier_series import periodic
from rhythmid.record.record import Channel, Record
from rhythmid.record.timing import GAP
from rhythmid.record.tolerable import tolerable_error

Array = NDArray[np.float64]


def acts_always(record: Record, role: str) -> bool:
    """Whether the forcing or input acts before its first sample and after its last: what a sensor records, not what a program sends."""
    if role == "forcing":
        return record.forcing_law is None
    return record.input_kind.startswith("base_") or (
        record.input_kind != "reference" and record.hold != "zero"
    )


def within_samples_of(record: Record, role: str, least: int) -> tuple[Record, float]:
    """The record without the measurements for which the channel is not known, and how much of the output [s] that leaves out.

    The channel is known beyond its samples where it hardly changes in so short a time, or where it repeats: then samples of its Fourier series
    are added. Nothing is left out where fewer than `least` measurements remain.
    """
    channel: Channel = getattr(record, role)
    output, period = record.output, channel.period
    spans = (channel.time[0] - output.time[0], output.time[-1] - channel.time[-1])
    counts = [int(span / period) if span > GAP * period else 0 for span in spans]
    if not any(counts):
        return record, 0.0
    allowed = tolerable_error(output) * max(float(np.std(channel.value)), 1e-300) / period
    law = periodic(channel.time, channel.value)
    added: list[tuple[Array, Array]] = []
    first, last = -np.inf, np.inf
    for count, step, edge in zip(counts, (-period, period), channel.time[[0, -1]]):
        if count == 0 or change_within(channel.value, count) * count < allowed:
            continue
        # no further than the record of it is long
        if law is not None and count < len(channel) and law.left * count < allowed:
            time = edge + step * np.arange(1, count + 1)
            added.append((time, law(time)))
        elif step < 0.0:
            first = edge
        else:
            last = edge
    if added:
        time, value = (np.concatenate(each) for each in zip((channel.time, channel.value), *added))
        order = np.argsort(time, kind="stable")
        record = replace(record, **{role: replace(channel, time=time[order], value=value[order])})
    keep = (output.time >= first) & (output.time <= last)
    if keep.all() or np.count_nonzero(keep) < least:
        return record, 0.0
    shorter = replace(output, time=output.time[keep], value=output.value[keep])
    return replace(record, output=shorter), output.period * np.count_nonzero(~keep)


def change_within(value: Array, count: int) -> float:
    """rms change of a signal (n,) over so many samples; infinite where there are too few to tell."""
    if 2 * count >= len(value):
        return np.inf
    return float(np.sqrt(np.mean((value[count:] - value[:-count]) ** 2)))
