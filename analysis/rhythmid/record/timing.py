"""Times of samples: order, duplicates, nominal period, gaps, jitter."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.irregular_stamps import COMMON, PAUSE, irregular, too_short, usual_range

GAP = 1.5  # periods between two samples, beyond which at least one is missing
LATE = 10.0  # periods by which a message may arrive late and still be put back in order
DISORDERED = 0.01  # share of stamps that may be earlier than the one before them by jitter
SAME = 1e-9  # seconds; times that differ by less are one
OFTEN = 0.1  # share of steps longer than 1.5 periods, beyond which a channel is not periodic
# samples on either side, beyond twice as many as may be missing, whose stamps tell whether any is
NEIGHBOURS = 25
# steps over which the period is read off in turn, up to about NEIGHBOURS, over which it must not drift
SPANS = (1, 2, 4, 8, 16, 32)
BURSTS = 0.5  # of the usual span's mean step, below which the usual step is one within a burst of messages that were held back
FULL = 0.5  # of the periods missing, by which the earliest sample after a gap is late,
JUDGED = 500  # long steps at most, by which it is judged whether the stamps are irregular: as many tell, and more take time
AT_AN_END = 0.95  # and where so few samples are left that all of them may have come late by jitter

Times = NDArray[np.float64]


@dataclass(frozen=True)
class Timing:
    """What the times of a channel or topic look like.

    Attributes
    ----------
    count : number of samples, duplicates included.
    start, end : first and last time [s].
    period : nominal time between samples [s]; 0 where there are fewer than two.
    jitter_std : standard deviation of the time between neighbours [s], gaps left out.
    gaps, lost : number of gaps (see `gaps_between`) and of samples that are missing in them.
    longest_gap : [s]; 0 without gaps.
    duplicates : samples with the time of another.
    late : samples that were recorded after one with a later time.
    usual_range : shortest and longest usual step [s] of irregular stamps, whose `period` is the mean step; None where the stamps are
        those of a period, however they jitter and whatever is missing. See `irregular_stamps`.
    """

    count: int
    start: float = 0.0
    end: float = 0.0
    period: float = 0.0
    jitter_std: float = 0.0
    gaps: int = 0
    lost: int = 0
    longest_gap: float = 0.0
    duplicates: int = 0
    late: int = 0
    usual_range: tuple[float, float] | None = None

    @property
    def rate(self) -> float:
        """Nominal samples per second [Hz]."""
        return 1.0 / self.period if self.period > 0.0 else 0.0

    @property
    def told_rate(self) -> str:
        """The rate in words; of irregular stamps the mean one, with their usual steps."""
        if self.usual_range is None:
            return f"{self.rate:.4g} Hz"
        shortest, longest = (1e3 * step for step in self.usual_range)
        return f"irregular stamps, usually {shortest:.3g} to {longest:.3g} ms apart, {self.rate:.4g} Hz on average"

    @classmethod
    def of(cls, time: Times) -> "Timing":
        """Timing of samples in the order of recording, float64[n] in seconds; any n, any order."""
        if len(time) == 0:
            return cls(0)
        late = int(np.count_nonzero(time < np.maximum.accumulate(time)))
        ordered = np.sort(time) if late else time
        step = np.diff(ordered)
        duplicates = int(np.count_nonzero(step == 0.0))
        step = step[step > 0.0] if duplicates else step
        start, end = float(ordered[0]), float(ordered[-1])
        if len(step) == 0:
            return cls(len(time), start, end, duplicates=duplicates, late=late)
        period, pause = _sampling(step)
        first, missing = _gaps(np.concatenate([[0.0], np.cumsum(step)]), period, pause)
        regular = np.delete(step, first)
        # late samples look like gaps, but nothing is missing then over the whole
        lost = min(int(missing.sum()), max(0, round((end - start) / period) - len(step)))
        return cls(
            len(time), start, end, period,
            round(float(np.sqrt(np.mean((regular - period) ** 2))), 10) if len(regular) else 0.0,
            len(first), lost, float(step[first].max(initial=0.0)), duplicates, late,
            None if pause is None else usual_range(step),
        )  # fmt: skip


def gaps_between(time: Times) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Gaps in increasing times (n,): of each the sample before it, and how many samples are missing; (g,) and (g,).

    A step of more than 1.5 periods that the steps around it make up for is jitter of the stamps or a burst of messages that were
    held up, and none: nothing comes early, so that after a real gap even the earliest of the next samples is late. Among irregular
    stamps only a pause is a gap. A channel in which long steps are common, such as a command that is sent when it changes, has none.
    """
    step = np.diff(time)
    period, pause = _sampling(step) if len(step) > 1 else (0.0, None)
    often = pause is None and np.count_nonzero(step > GAP * period) > OFTEN * len(step)
    if period == 0.0 or often:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    return _gaps(time, period, pause)


def _gaps(time: Times, period: float, pause: float | None) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Gaps in increasing times (n,) as `gaps_between` gives them: of what is sampled once in a `period` [s], or irregularly, steps
    beyond a `pause` [s]."""
    step = np.diff(time)
    wide = np.flatnonzero(step > (GAP * period if pause is None else pause))
    lost = np.maximum(np.rint(step[wide] / period - 1.0).astype(np.int64), 1)
    if pause is not None:
        return wide, lost
    real = _not_made_up_for(time, period, wide, lost)
    return wide[real], lost[real]


def _not_made_up_for(
    time: Times, period: float, wide: NDArray[np.int64], lost: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether the stamps around `wide` steps (w,), in which so many samples seem `lost`, do not make up for them."""
    late = time - period * np.arange(len(time))
    real = np.zeros(len(wide), dtype=bool)
    for index, (before, count) in enumerate(zip(wide, 2 * lost + NEIGHBOURS, strict=True)):
        earlier, later = late[max(before + 1 - count, 0) : before + 1], late[before + 1 : before + 1 + count]
        share = FULL if min(len(earlier), len(later)) == count else AT_AN_END
        real[index] = later.min() - earlier.min() > share * period * lost[index]
    return real


def nominal_period(step: Times) -> float:
    """Nominal period from the positive times between samples [s]: the usual step, or of irregular stamps the mean one.

    The median, refined over 1, 2, 4, ... steps by the mean of those spans that lie within half a period of so many periods: what
    jitter and rounding do to a period falls with the length of the span, and spans in which a sample is missing are left out.
    Where messages were held back and came in bursts, it is the mean step of the usual span instead.

    Rounded to whole nanoseconds, the resolution of stamps; not where the steps are even and the rounding would lead away from them.
    """
    return _sampling(step)[0]


def _sampling(step: Times) -> tuple[float, float | None]:
    """Nominal period [s] of steps (n,); and of irregular stamps the step [s] beyond which one is a pause, else None."""
    period, bursts = _usual_step(step)
    if bursts or not (too_short(step, period) or irregular(step, period, _long_steps(step, period))):
        return period, None
    pause = PAUSE * usual_range(step)[1]
    return round(float(np.mean(step[step <= pause])) * 1e9) * 1e-9, pause


def _long_steps(step: Times, period: float) -> Times:
    """Steps (g,) that are gaps if these are the steps (n,) of a period, or as many of them as tell; none where they are rare."""
    wide = np.flatnonzero(step > GAP * period)
    if len(wide) <= COMMON * len(step):
        return np.empty(0)
    chosen = wide[:: math.ceil(len(wide) / JUDGED)]
    lost = np.maximum(np.rint(step[chosen] / period - 1.0).astype(np.int64), 1)
    real = _not_made_up_for(np.concatenate([[0.0], np.cumsum(step)]), period, chosen, lost)
    return step[chosen[real]] if real.mean() * len(wide) > COMMON * len(step) else np.empty(0)


def _usual_step(step: Times) -> tuple[float, bool]:
    """The period of steps (n,), and whether they come in bursts."""
    period = float(
        np.percentile(step, 50.0, method="lower")
    )  # a step that occurs, where steps are of two kinds
    time = np.concatenate([[0.0], np.cumsum(step)])
    longest = max(count for count in SPANS if count <= len(step))
    usual = float(np.median(time[longest:] - time[:-longest])) / longest
    if period < BURSTS * usual:
        return usual, True
    even = False
    for steps in (count for count in SPANS if count <= len(step)):
        span = time[steps:] - time[:-steps]
        near = span[np.abs(span - steps * period) < 0.5 * period]
        if len(near) == 0:
            break
        period = float(np.mean(near)) / steps
        if steps == 1:
            even = float(np.abs(near - period).max()) < 2.0 * SAME
    whole = round(period * 1e9) * 1e-9
    exact = whole == 0.0 or (even and abs(whole - period) * len(step) > 0.5 * SAME)
    return period if exact else whole, False


def put_in_order(time: Times, label: str, mend: str) -> NDArray[np.int64]:
    """Indices that put samples in order of time; of samples with one time, only the first is kept.

    Messages may overtake one another on their way to the recorder. Such a message is put back where it belongs: it is
    at most 10 periods late and fills a hole, so that no two samples come closer than half a period. Stamps that jitter may change
    places with their neighbours now and then. Any other step backwards means that the clock was set back, and then the recording cannot be trusted.

    Raises InputError, beginning with `label` and ending with `mend`, when time goes backwards or stands still.
    """
    if len(time) > 1 and time.min() == time.max():
        raise InputError(f"{label}: all {len(time)} samples have the same time, {time[0]:g} s; {mend}")
    newest = np.maximum.accumulate(time)
    late = np.flatnonzero(time < newest)
    if len(late) == 0:
        return np.flatnonzero(np.diff(time, prepend=-np.inf) > 0.0)
    order = np.argsort(time, kind="stable")
    kept = order[np.diff(time[order], prepend=-np.inf) > 0.0]
    step = np.diff(time[kept])
    period = nominal_period(step)
    if (newest[late] - time[late]).max() < period and len(late) < DISORDERED * len(time):
        return kept  # no clock but its jitter
    moved = np.flatnonzero(np.isin(kept, late))
    near = np.concatenate([step[moved[moved > 0] - 1], step[moved[moved < len(step)]]])
    fills = len(moved) == len(late) and (near >= 0.5 * period).all()
    if not fills or (newest[late] - time[late]).max() > LATE * period:
        first = late[0]
        raise InputError(
            f"{label}: time goes backwards by {newest[first] - time[first]:.6g} s at {newest[first]:.6f} s "
            f"(sample {first} of {len(time)}): the clock was set back, or that row is damaged; {mend}"
        )
    return kept
