"""Detects an output that leads its reference: the channels are exchanged, or the reference was logged late.

A controller responds after its reference changes. Where both channels show the same motion, the lag between them is
at the maximum of their correlation. The lag is measured in several parts of the record; its spread gives the error.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Record
from rhythmid.report.quantity import number, rounded

Array = NDArray[np.float64]
PARTS = 6  # of a record, each with its own lag
LEAST_SAMPLES = 64  # least samples in a part; fewer give no lag
FARTHEST = 0.25  # largest lag on either side, as a share of a part
# samples by which an output may seem to come before its command, and an estimated delay be negative: an input that is taken for held
# but is not gives up to 1.5 samples
EARLIEST = 1.5
# standard errors by which the lead must exceed that, and a delay be negative, to be reported: with two, a machine without delay
# would be reported once in 40 times
SURE = 4.0
# largest ratio of the residual at the best lead to that at the best lag: with a single sine either channel seems to
# follow the other
PLAINLY = 0.5


def early_outputs(records: Sequence[Record]) -> list[str]:
    """A note for each record whose output leads its reference."""
    return [note for record in records if (note := early_output(record)) is not None]


def early_output(record: Record) -> str | None:
    """A note where the output leads the reference; None where it does not, or where the two are different quantities."""
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
    """Lead [s] of the output over the reference, its standard error [s], and the period [s] of the slower channel;
    None where it cannot be determined."""
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
    """Lead of the output over the reference in samples; None where one of them is constant, or where a lag explains
    the output as well."""
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
    """Share of the output's power that the reference, `shift` samples earlier, does not explain."""
    first, second = (u[: len(u) - shift], y[shift:]) if shift >= 0 else (u[-shift:], y[:shift])
    power = float(second @ second)
    if power == 0.0 or not first.any():
        return 1.0
    return 1.0 - float(first @ second) ** 2 / (power * float(first @ first))
