"""Hold of a command between samples: a command holds its value until the next one; a measured signal changes between samples.

Two kinds of commands show their hold. One comes as an event: where samples do not resolve the signal, neither straight
lines nor a band-limited curve give its values between them. The samples show whether they resolve it: then a line
through a sample's neighbours is closer to it than the sample before. The other is logged more often than it is
updated: after a step it stands still, exactly, until the next update. A measured signal that is rounded also stands
still, but then its steps are those of its rounding.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel, Record
from rhythmid.record.rounding import shown_resolution

Array = NDArray[np.float64]
# ratio of the input's interval to the output's above which the input is far sparser. Loggers sample measured
# signals together, or divide a clock by a small number
SPARSE = 10.0
# ratio of rms errors, a line through both neighbours over the sample before, below which samples resolve the
# signal. It is sin(π f T) for a sine of frequency f sampled every T [s], so this is six samples per period, of
# which a line misses 13 %. Unrelated steps give 0.71, independent samples 0.87
RESOLVED = 0.5
LEAST_SAMPLES_TO_RESOLVE = 3  # samples, of which one has two neighbours
# share of the changes that are steps after which the signal stands still, above which it is held between updates: these are at
# least 1.5 samples apart. A signal within limits stands still after few changes; one with spikes on a constant level after half
STANDS_STILL = 0.5
ROUNDING = 1.5  # rounding steps: a change of one may be that of a rounded signal


def held_note(given: Channel, answer: Channel) -> str | None:
    """Message about a driving channel that is far sparser than the response and changes in steps; None where it is
    not."""
    (time, first), (of_answer, _) = (np.unique(one.time, return_index=True) for one in (given, answer))
    value = given.value[first]
    if len(time) < 2 or len(of_answer) < 2 or not np.isfinite(value).all() or np.ptp(value) == 0.0:
        return None
    if interval := update_interval(given, answer):
        return (
            f"its value stands still from one step to the next, usually for {interval:.3g} s: each is taken as held until the next one "
            "(hold: zero); where it was measured, say  hold: linear"
        )
    usual = float(np.median(np.diff(time)))
    if usual < SPARSE * float(np.median(np.diff(of_answer))) or _is_resolved(time, value):
        return None
    return (
        f"its {len(given)} samples, usually {usual:.3g} s apart, change in steps and are far sparser than the output's: each is taken as "
        "held until the next one (hold: zero); where it was measured, say  hold: linear"
    )


def update_interval(given: Channel, answer: Channel) -> float:
    """Usual time [s] from one step of a driving channel to the next, where it stands still between them; 0 where it does not.

    Samples at which the response also has its previous value are copies of a message, and do not count.
    """
    copied = answer.time[1:][answer.value[1:] == answer.value[:-1]]
    kept = ~np.isin(given.time, copied)
    time, value = given.time[kept], given.value[kept]
    change = np.abs(np.diff(value))
    at = np.flatnonzero(change[:-1])
    step = change[at] > ROUNDING * shown_resolution(value)
    if len(at) == 0 or np.mean(step & (change[at + 1] == 0.0)) <= STANDS_STILL:
        return 0.0
    return float(np.median(np.diff(time[at + 1]))) if len(at) > 1 else float(np.ptp(time))


def with_hold(record: Record) -> Record:
    """A table's record with the hold of its input: steps for events; else band-limited where evenly spaced
    apart from gaps, linear otherwise."""
    if record.input is None:
        return record
    if note := held_note(record.input, record.output):
        quality = replace(record.quality, notes=(*record.quality.notes, f"input: {note}"))
        return replace(record, hold="zero", quality=quality)
    step = np.diff(record.input.time)
    periods = np.rint(step / record.input.period)  # more than one where samples are missing
    even = len(step) > 2 and np.abs(step - periods * record.input.period).max() < 2e-9 and periods.min() > 0.0
    return replace(record, hold="band_limited" if even else "linear")


def with_held_commands(record: Record) -> Record:
    """The record with the timing of its input as that of a held command, where it is held."""
    if record.input is None or record.hold != "zero":
        return record
    known, given = record.quality.channels, record.input
    timing = known["input"].timing.of_held(given.time, given.value)
    channels = {**known, "input": replace(known["input"], timing=timing)}
    return replace(record, quality=replace(record.quality, channels=channels))


def _is_resolved(time: Array, value: Array) -> bool:
    """Whether samples (n,) resolve their signal; False for too few samples."""
    if len(value) < LEAST_SAMPLES_TO_RESOLVE:
        return False
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    off_line = value[1:-1] - value[:-2] - share * (value[2:] - value[:-2])
    return float(off_line @ off_line) < RESOLVED**2 * float(np.sum(np.diff(value)[:-1] ** 2))
