"""Samples that arrived in bursts and are stamped with their arrival times: reconstruction of their sampling times.

A device samples evenly; a network or a logger passes the samples on in bursts. Sample k was taken at a + b k, and
the rest of its time is latency. The line is the highest one below all arrival times (S. B. Moon, P. Skelly, D.
Towsley, IEEE INFOCOM 1999, 227). The earliest samples count as having no latency, because a delay common to all
cannot be observed.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from rhythmid.record.record import Channel
from rhythmid.record.timing import BURSTS, nominal_period

Array = NDArray[np.float64]
# ratio of errors of a straight line through both neighbours, even over recorded times, below which the even times
# are better: noise alone gives 0.87
SMOOTHER = 0.5
MINIMA = 64  # parts of a recording; only the earliest sample of each can touch the line
# parts of a recording whose earliest samples are compared: a lost sample shifts all later ones, a busy network
# delays only some
PARTS = 8
# periods by which the earliest samples may be late: one lost sample gives 0.8, bursts of 4 to 6 samples alone up to 0.4
STEADY = 0.5
LEAST_SAMPLES_IN_BURSTS = 200  # so that each part has several bursts


def without_bursts(channels: Mapping[str, Channel]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The channels with the sampling times of samples that arrived in bursts, and a note where there are such samples.

    Channels with the same times are treated together. A channel with missing samples keeps its times.
    """
    found, notes = dict(channels), []
    for role, channel in channels.items():
        if found[role] is not channel:
            continue
        together = [name for name, other in channels.items() if other.time is channel.time]
        taken = _taken(channel.time, [channels[name].value for name in together])
        if taken is None:
            continue
        for name in together:
            found[name] = replace(channels[name], time=taken)
        latest = 1e3 * float((channel.time - taken).max())
        notes.append(
            f"{' and '.join(together)}: the samples came in bursts, up to {latest:.3g} ms late, and are taken as evenly spaced, every "
            f"{1e3 * float(taken[1] - taken[0]):.6g} ms; a log of the device's own stamps needs no such assumption"
        )
    return found, tuple(notes)


def _taken(time: Array, values: list[Array]) -> Array | None:
    """Sampling times (n,) of samples that arrived at `time` (n,); None where the two agree, or where samples are
    missing."""
    if len(time) < LEAST_SAMPLES_IN_BURSTS:
        return None
    step = np.diff(time)
    if float(np.median(step)) >= BURSTS * nominal_period(step):
        return None
    if not any(_smoother(time, value) for value in values):
        return None
    number = np.arange(len(time), dtype=float)
    first, period = _line_below(number, time)
    late = time - (first + period * number)
    soonest = [float(part.min()) for part in np.array_split(late, PARTS)]
    if period <= 0.0 or max(soonest) > STEADY * period:
        return None
    return first + period * number


def _line_below(number: Array, time: Array) -> tuple[float, float]:
    """Value at zero and slope of the straight line below all points that is closest to them on average."""
    slope, _ = np.polyfit(number, time, 1)
    left = time - slope * number
    lowest = [int(part[np.argmin(left[part])]) for part in np.array_split(np.arange(len(left)), MINIMA)]
    scale = float(number[-1])
    found = linprog(
        [-1.0, -0.5],
        np.column_stack([np.ones(MINIMA), number[lowest] / scale]),
        left[lowest],
        bounds=(None, None),
    )
    return float(found.x[0]), float(slope + found.x[1] / scale)


def _smoother(time: Array, value: Array) -> bool:
    """Whether samples are closer to a straight line through their neighbours with even times than with the recorded
    times."""
    before, after = value[:-2], value[2:]
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    even = value[1:-1] - 0.5 * (before + after)
    given = value[1:-1] - before - share * (after - before)
    return float(np.sum(even**2)) < SMOOTHER**2 * float(np.sum(given**2))
