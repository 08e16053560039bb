"""An output that comes before the reference which it is said to follow: the channels are exchanged, or the reference was logged late.

A controller answers after it is asked. Where the same motion shows in both channels, the time between them is that of their greatest
correlation. It is measured in parts of the record, whose spread is its error.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Record
from rhythmid.report.quantity import number, rounded

Array = NDArray[np.float64]
PARTS = 6  # of a record, each with a time of its own
LEAST_SAMPLES = 64  # of a part: fewer tell no time
FARTHEST = 0.25  # of a part, up to which a time is sought on either side
# samples of the slower channel by which the output has to come early: an input that is not held, but taken for held, makes it one and a half
EARLIEST = 1.5
SURE = 4.0  # standard errors by which it has to be beyond that, as for a delay that comes out negative
# times what the best answer that comes late leaves, up to which the early one may leave: of one sine either comes after the other
PLAINLY = 0.5


def early_outputs(records: Sequence[Record]) -> list[str]:
    """A note for each record whose output comes before its reference."""
    return [note for record in records if (note := early_output(record)) is not None]


def early_output(record: Record) -> str | None:
    """A note where the output comes before the reference; None where it does not, or the two are not the same quantity."""
    if record.input is None or record.input_kind != "reference" or record.input.unit != record.output.unit:
        return None
    found = _lead(record)
    if found is None:
        return None
    lead, error, period = found
    if lead - EARLIEST * period <= SURE * error:
        return None
    size = f"{rounded(1e3 * lead, 1e3 * error)} ± {number(1e3 * error, 2)} ms ({number(lead / period, 2)} samples)"
    return (
        f"{record.name}: the output comes {size} before the reference, but no machine answers before it is asked: are the two exchanged in "
        "signals.yaml, or was the reference filtered or logged late?"
    )


def _lead(record: Record) -> tuple[float, float, float] | None:
    """By how much [s] the output comes before the reference, the standard error of that, and the period [s] of the slower channel; None
    where that is not to be told."""
    reference, output = record.input, record.output
    assert reference is not None
    begin, end = max(reference.time[0], output.time[0]), min(reference.time[-1], output.time[-1])
    period = max(reference.period, output.period)
    count = int((end - begin) / period)
    if count < PARTS * LEAST_SAMPLES:
        return None
    grid = begin + period * np.arange(count)
    pairs = zip(
        np.array_split(_at(grid, reference.time, reference.value), PARTS),
        np.array_split(_at(grid, output.time, output.value), PARTS),
        strict=True,
    )
    leads = np.array([one for u, y in pairs if (one := _lead_of(u, y)) is not None])
    if len(leads) < 2:
        return None
    return period * float(np.median(leads)), period * _error(leads), period


def _at(grid: Array, time: Array, value: Array) -> Array:
    kept = np.isfinite(value)
    return np.interp(grid, time[kept], value[kept])


def _error(leads: Array) -> float:
    return float(np.std(leads, ddof=1)) / math.sqrt(len(leads))


def _lead_of(reference: Array, output: Array) -> float | None:
    """Samples by which the output comes before the reference; None where one of them rests, or coming late explains the output as well."""
    u, y = reference - reference.mean(), output - output.mean()
    if not u.any() or not y.any():
        return None
    most = int(FARTHEST * len(u))
    left = np.array([_left(u, y, shift) for shift in range(-most, most + 1)])
    best = int(np.argmin(left))
    if best in (0, len(left) - 1):
        return None
    if best < most and left[best] > PLAINLY * float(left[most:].min()):
        return None
    before, here, after = left[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    return most - best - (0.5 * float((before - after) / bend) if bend > 0.0 else 0.0)


def _left(u: Array, y: Array, shift: int) -> float:
    """Share of the output's power that the reference leaves, `shift` samples later."""
    first, second = (u[: len(u) - shift], y[shift:]) if shift >= 0 else (u[-shift:], y[:shift])
    power = float(second @ second)
    if power == 0.0 or not first.any():
        return 1.0
    return 1.0 - float(first @ second) ** 2 / (power * float(first @ first))
