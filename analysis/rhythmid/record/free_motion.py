"""The part of a motion that nothing recorded drives in which it is free: after a rest in which it was held, between pushes
by hand.

A free machine with one degree of freedom only loses energy. So it passes through a place more slowly each time, and a
passage that is faster than the one before shows that something pushed it in between.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from rhythmid.record.record import Record

Array = NDArray[np.float64]
FIRST = 3  # samples whose median is the place where a motion starts
AT_REST = 0.02  # share of a motion's distance from its start up to which it has not begun
HALFWAY = 0.5  # half of that distance
# least duration of a rest before the motion, relative to the time from the start to half of the distance. A machine
# released at the first sample stays within a fiftieth for at most a quarter of that time: the parabola of a
# constant force
LONG = 1.0
MOST_SAMPLES = 20_000  # largest number of samples used: the passages are slow
POWER = 0.99  # share of the motion's power below the frequency that sets the smoothing
SMOOTHED = 0.125  # length of the smoothing in periods of that frequency: it changes a sine by less than 1 %
PLACES = 50  # places of two passages at which their speeds are compared
LEAST_WAY = 0.01  # least way that two passages have in common, as a share of the travel: less is noise
# least ratio of the squared speeds of a passage and the one before: a smoothed turning point at the end of the record
# changes it by a tenth
GAIN = 1.25
LEAST_GAIN = 0.01  # least increase of the squared speed, as a share of its largest: less is noise
# least ratio of the time in which a motion of one direction loses speed to that in which it gained it, for a push: a machine
# that swings to the other side takes as long for either
COASTING = 2.0
LEAST_PASSAGES = 2  # passages without a push between two, so that the motion is free at all


@dataclass(frozen=True)
class Freed:
    """The time `begin` [s] from which a motion is free, the time `until` [s] up to which it was held, or `pushed`
    at least, and the time `end` [s] up to which it is free, None where it is to the end of the record."""

    begin: float
    until: float
    pushed: bool
    end: float | None = None


@dataclass(frozen=True)
class Span:
    """The strokes without a push between them: the first and the last of them, counted from 0, of all `count`."""

    first: int
    last: int
    count: int


def freed(record: Record) -> Freed | None:
    """Where a motion is free that nothing recorded drives at first; None where it is free throughout, or driven from its
    start.

    Between pushes it is taken from its fastest point after the one to the last but one turning point before the other: a hand may
    still, or already, lead it elsewhere. A motion of one direction that gains speed and loses it for much longer counts as pushed: a release
    through which it comes to rest on the same side is nearly as free from its fastest point on.
    """
    if record.output_kind == "acceleration" or len(record.output) < 4 * FIRST:
        return None
    rest = _rest(record)
    if rest is None and _drives(record, float(record.output.time[-1])):
        return None
    since = float(record.output.time[0]) if rest is None else rest
    position, speed, time = _motion(record, since)
    if len(time) < PLACES:
        return None if rest is None else Freed(rest, rest, False)
    strokes = _strokes(speed)
    span = _free_span(position, speed, strokes)
    if span is not None and not _drives(record, float(time[-1])):
        return _between_pushes(time, speed, strokes, span, rest)
    away = strokes[0] if len(strokes) else slice(0, len(time))
    unseen = record.output_kind == "velocity" and rest is not None
    if not _turns(speed) and (unseen or (not _drives(record, float(time[-1])) and _coasts(time, speed))):
        begin = _fastest(time, speed, away)  # nothing tells a push from a release
        return Freed(begin, begin, True)
    return None if rest is None else Freed(rest, rest, False)


def _rest(record: Record) -> float | None:
    """End [s] of the rest with which an output starts that nothing drives until it has moved; None where it moves
    from its first sample on."""
    value, time = record.output.value, record.output.time
    away = np.abs(value - np.median(value[:FIRST]))
    way = float(away.max())
    moving = int(np.argmax(away > AT_REST * way)) if way > 0.0 else 0
    if moving == 0:
        return None
    half, rested = float(time[np.argmax(away > HALFWAY * way)]), float(time[moving - 1])
    if rested - time[0] < LONG * (half - rested) or _drives(record, half):
        return None
    return rested


def _drives(record: Record, until: float) -> bool:
    """Whether something that may drive the machine was recorded as other than zero before a time [s]."""
    if record.forcing is not None or record.forcing_law is not None:
        return True
    channels = (record.input, record.effort, record.reference)
    return any(one is not None and bool(np.any(one.value[one.time <= until])) for one in channels)


def _motion(record: Record, since: float) -> tuple[Array, Array, Array]:
    """Position and speed (n,) of the output from a time [s] on, smoothed, and their times (n,) [s]."""
    kept = record.output.time >= since
    time, value = record.output.time[kept], record.output.value[kept]
    count = min(len(time), MOST_SAMPLES)
    if count < PLACES:
        return np.empty(0), np.empty(0), np.empty(0)
    grid: Array = np.linspace(time[0], time[-1], count)
    period = float(grid[1] - grid[0])
    value = np.interp(grid, time, value)
    power = np.abs(np.fft.rfft((value - value.mean()) * np.hanning(count))) ** 2
    total = np.cumsum(power)
    highest = max(int(np.searchsorted(total, POWER * total[-1])), 1) / (count * period)
    length = min(max(2 * int(0.5 * SMOOTHED / (highest * period)) + 1, 5), 2 * ((count - 1) // 2) - 1)
    if record.output_kind == "velocity":
        speed = np.asarray(savgol_filter(value, length, 2), dtype=np.float64)
        position = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * period])
        return position, speed, grid
    speed = np.asarray(savgol_filter(value, length, 2, deriv=1, delta=period), dtype=np.float64)
    return np.asarray(savgol_filter(value, length, 2), dtype=np.float64), speed, grid


def _strokes(speed: Array) -> list[slice]:
    """Parts of a motion (n,) between its turning points, each with a clear speed."""
    least = AT_REST * float(np.abs(speed).max())
    turned = np.flatnonzero(np.diff(np.sign(speed)) != 0) + 1
    edges = [0, *turned.tolist(), len(speed)]
    made: list[slice] = []
    for begin, end in zip(edges[:-1], edges[1:]):
        clear = np.abs(speed[begin:end]).max() > least
        if clear and made and np.sign(speed[begin:end].sum()) == np.sign(speed[made[-1]].sum()):
            made[-1] = slice(made[-1].start, end)
        elif clear:
            made.append(slice(begin, end))
    return made


def _free_span(position: Array, speed: Array, strokes: list[slice]) -> Span | None:
    """The span of most strokes in which the machine passes through the same places more slowly each time; None where
    that are all strokes, or no more than in the other spans together: then it is driven."""
    changes = [_change(position, speed, one, other) for one, other in zip(strokes, strokes[1:])]
    edges = [-1, *(place for place, change in enumerate(changes) if change > 0), len(changes)]

    def losses(span: tuple[int, int]) -> int:
        return changes[span[0] + 1 : span[1]].count(-1)

    first, last = longest = max(pairwise(edges), key=losses)
    if len(edges) == 2 or losses(longest) < LEAST_PASSAGES or 2 * losses(longest) <= changes.count(-1):
        return None
    return Span(first + 1, last, len(strokes))


def _between_pushes(time: Array, speed: Array, strokes: list[slice], span: Span, rest: float | None) -> Freed:
    end = None if span.last == span.count - 1 else float(time[strokes[span.last].start])
    if span.first == 0:
        begin = float(time[0]) if rest is None else rest
        return Freed(begin, begin, False, end)
    after = strokes[span.first]
    return Freed(_fastest(time, speed, after), float(time[after.start]), True, end)


def _change(position: Array, speed: Array, one: slice, other: slice) -> int:
    """1 where a stroke is clearly faster than the one before at the places of both, −1 where it is no faster, and 0 where
    neither shows."""
    before, after = position[one], position[other]
    low, high = max(before.min(), after.min()), min(before.max(), after.max())
    if high - low < LEAST_WAY * np.ptp(position):
        return 0
    places = np.linspace(low, high, PLACES)
    squared = []
    for part, x in ((one, before), (other, after)):
        order = np.argsort(x)
        squared.append(float(np.mean(np.interp(places, x[order], speed[part][order] ** 2))))
    increase = squared[1] - squared[0]
    if squared[1] > GAIN * squared[0] and increase > LEAST_GAIN * float(np.max(speed**2)):
        return 1
    return -1 if increase <= 0.0 else 0


def _coasts(time: Array, speed: Array) -> bool:
    """Whether a motion (n,) of one direction gains speed first and then clearly loses it for much longer."""
    squared = speed**2
    top = int(np.argmax(squared))
    if top == 0 or GAIN * max(squared[0], squared[-1]) > squared[top]:
        return False
    begin = int(np.argmax(np.abs(speed) > AT_REST * np.abs(speed[top])))
    return float(time[-1] - time[top]) >= COASTING * float(time[top] - time[begin])


def _fastest(time: Array, speed: Array, part: slice) -> float:
    """Time [s] of the largest speed in a part."""
    return float(time[part.start + int(np.argmax(np.abs(speed[part])))])


def _turns(speed: Array) -> bool:
    """Whether a motion clearly changes its direction."""
    return len(_strokes(speed)) > 1
