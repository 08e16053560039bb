"""Ends of a record: measurements before the first and after the last sample of a force that also acted then.

A recorder subscribes to one topic later than to another. A pump's force did not start with its first recorded
message. If the forcing were taken as constant before it, the model would seem to lack an effect. A signal that a
program sends, such as a held command or a reference, does start with its first message.
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
    """Whether the forcing or input also acts before its first and after its last sample: true for sensor data, not
    for sent signals."""
    if role == "forcing":
        return record.forcing_law is None
    return record.input_kind.startswith("base_") or (
        record.input_kind != "reference" and record.hold != "zero"
    )


def within_samples_of(record: Record, role: str, least: int) -> tuple[Record, float]:
    """The record without the measurements for which the channel is unknown, and the duration [s] of output that is
    left out.

    Beyond its samples the channel is known where it hardly changes in so short a time. It is also known where it is
    periodic: then samples of its Fourier series are added. Nothing is left out where fewer than `least`
    measurements would remain.
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
        # at most by the length of the channel's record
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
    """rms change of a signal (n,) over `count` samples; infinite where there are too few to measure it."""
    if 2 * count >= len(value):
        return np.inf
    return float(np.sqrt(np.mean((value[count:] - value[:-count]) ** 2)))
