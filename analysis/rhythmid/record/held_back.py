"""Samples that were held back and came in bursts, each with the time at which it came: when they were taken.

A device samples evenly; a network or a logger passes the samples on in bursts. The k-th was then taken at a + b k, and came late by
what is left of its time. The line is the highest that no sample came before (S. B. Moon, P. Skelly, D. Towsley, IEEE INFOCOM 1999, 227):
the samples that came soonest count as not late at all, for a delay that all share cannot be seen.
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
# of the error of a straight line through both neighbours, at which samples are the smoother for even times: noise alone makes it 0.87
SMOOTHER = 0.5
MINIMA = 64  # parts of a recording of whose samples only the soonest can touch the line
PARTS = 8  # of a recording, whose soonest samples are compared: a lost sample shifts all that follow, a busy network only delays some
STEADY = 0.5  # of a period, by which these may be late: one lost sample makes it 0.8, bursts of 4 to 6 samples alone up to 0.4
LEAST_SAMPLES_IN_BURSTS = 200  # samples, so that each part has several bursts


def evened(channels: Mapping[str, Channel]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The channels with the times at which samples that came in bursts were taken, and a note where there are such.

    Channels that share their times are treated alike. A channel in which samples are missing keeps its times.
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
    """Times (n,) at which samples were taken that came at `time`; None where that is when they came, or samples are missing."""
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
    """Value at zero and slope of the straight line below all points that comes nearest to them on average."""
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
    """Whether samples lie nearer to a straight line through their neighbours at even times than at the times given."""
    before, after = value[:-2], value[2:]
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    even = value[1:-1] - 0.5 * (before + after)
    given = value[1:-1] - before - share * (after - before)
    return float(np.sum(even**2)) < SMOOTHER**2 * float(np.sum(given**2))
