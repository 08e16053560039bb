"""A command that comes as an event is in force until the next one; a measured channel is a signal between its samples, too.

Neither straight lines nor a band-limited curve say what was between samples that do not resolve the signal. Whether they do, they show
themselves: a line through both neighbours of a sample comes nearer to it than the sample before does.
"""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.record import Channel

Array = NDArray[np.float64]
# usual intervals of the output, from which one of the input is far longer. Loggers read what is measured side by side, or divide
# a clock by some small number
SPARSE = 10.0
# of the error of the sample before, rms: what a line through both neighbours may leave of a signal that its samples resolve. It is
# sin(π f T) for a sine f sampled every T [s], so this is six samples a period, of which a line misses 13 %; steps that have nothing
# to do with each other leave 0.71, independent samples 0.87
RESOLVED = 0.5
LEAST_SAMPLES_TO_RESOLVE = 3  # samples, of which one has two neighbours


def held_note(given: Channel, answer: Channel) -> str | None:
    """What to tell of a channel that drives where it is far sparser than what answers and changes in steps; None where it is not."""
    (time, first), (of_answer, _) = (np.unique(one.time, return_index=True) for one in (given, answer))
    value = given.value[first]
    if len(time) < 2 or len(of_answer) < 2 or np.ptp(value) == 0.0:
        return None
    usual = float(np.median(np.diff(time)))
    if usual < SPARSE * float(np.median(np.diff(of_answer))) or _is_resolved(time, value):
        return None
    return (
        f"its {len(given)} samples, usually {usual:.3g} s apart, change in steps and are far sparser than the output's: each is taken as "
        "held until the next one (hold: zero); where it was measured, say  hold: linear"
    )


def _is_resolved(time: Array, value: Array) -> bool:
    """Whether samples (n,) go on smoothly from one to the next; too few show nothing of the kind."""
    if len(value) < LEAST_SAMPLES_TO_RESOLVE:
        return False
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    off_line = value[1:-1] - value[:-2] - share * (value[2:] - value[:-2])
    return float(off_line @ off_line) < RESOLVED**2 * float(np.sum(np.diff(value)[:-1] ** 2))
