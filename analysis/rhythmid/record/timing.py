"""Timing of samples: order, duplicates, nominal period, gaps, jitter."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.errors import InputError
from rhythmid.record.irregular_stamps import COMMON, PAUSE, irregular, too_short, usual_range

GAP = 1.5  # periods between two samples above which at least one is missing
LATE = 10.0  # periods by which a message may be late and still be sorted into place
DISORDERED = 0.01  # share of stamps that may be earlier than the previous one because of jitter
SAME = 1e-9  # [s]; times that differ by less are equal
OFTEN = 0.1  # share of steps longer than 1.5 periods above which a channel is not periodic
# samples on either side, beyond twice the possible number of missing ones, whose stamps show whether any is missing
NEIGHBOURS = 25
# numbers of steps over which the period is estimated in turn, up to about NEIGHBOURS, over which it must not drift
SPANS = (1, 2, 4, 8, 16, 32)
# ratio to the usual span's mean step below which the usual step lies within a burst of delayed messages
BURSTS = 0.5
# samples after a step, as a multiple of those before it, whose earliest shows whether any is missing: a busy computer
# works off its backlog within some tenths of a second
CATCHING_UP = 10
# parts of a record in bursts of which one step is the usual one: long enough for the length of a burst not to matter, short
# enough for most parts to be without a gap
PARTS = 8
FULL = 0.5  # least delay of the earliest sample after a gap, as a share of the missing periods
# largest number of long steps used to detect irregular stamps: more steps take time without changing the result
JUDGED = 500
# samples from which on what follows a step back is a run of its own and no mixed-up rows
SHORTEST_RUN = 20
AT_AN_END = 0.95  # the same near an end, where so few samples remain that all may be late because of jitter

Times = NDArray[np.float64]


@dataclass(frozen=True)
class Timing:
    """Timing of a channel or topic.

    Attributes
    ----------
    count : number of samples, duplicates included.
    start, end : first and last time [s].
    period : nominal time between samples [s]; 0 where there are fewer than two.
    jitter_std : standard deviation of the time between neighbours [s], without gaps.
    gaps, lost : number of gaps (see `gaps_between`) and of samples missing in them.
    longest_gap : [s]; 0 without gaps.
    duplicates : samples with the time of another.
    late : samples recorded after one with a later time.
    usual_range : shortest and longest usual step [s] of irregular stamps, whose `period` is the mean step; None for
        periodic stamps, whatever their jitter and gaps. See `irregular_stamps`.
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
        """The rate in words; for irregular stamps the mean rate, with their usual steps."""
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
        # late samples look like gaps, but over the whole nothing is missing
        lost = min(int(missing.sum()), max(0, round((end - start) / period) - len(step)))
        return cls(
            len(time), start, end, period,
            round(float(np.sqrt(np.mean((regular - period) ** 2))), 10) if len(regular) else 0.0,
            len(first), lost, float(step[first].max(initial=0.0)), duplicates, late,
            None if pause is None else usual_range(step),
        )  # fmt: skip

    def of_held(self, time: Times, value: Times) -> "Timing":
        """The timing of a held command with increasing times (n,) and values (n,): one that has the same value after a
        gap as before it acted all along, and is not missing."""
        if self.gaps == 0 or len(time) < 2:
            return self
        step = np.diff(time)
        first, missing = _gaps(time, *_sampling(step))
        changed = value[first] != value[first + 1]
        longest = float(step[first[changed]].max(initial=0.0))
        gaps, lost = int(np.count_nonzero(changed)), int(missing[changed].sum())
        return replace(
            self,
            gaps=min(self.gaps, gaps),
            lost=min(self.lost, lost),
            longest_gap=min(self.longest_gap, longest),
        )


def gaps_between(time: Times) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Gaps in increasing times (n,): for each the sample before it (g,), and the number of missing samples (g,).

    A step of more than 1.5 periods that the surrounding steps compensate is stamp jitter or a burst of delayed
    messages, and no gap; a busy computer may take some tenths of a second to catch up. No message is early, so after a real gap even the earliest of the next samples is late.
    Among irregular stamps only a pause is a gap. A channel in which long steps are common, such as a command that
    is sent when it changes, has no gaps.
    """
    step = np.diff(time)
    period, pause = _sampling(step) if len(step) > 1 else (0.0, None)
    often = pause is None and np.count_nonzero(step > GAP * period) > OFTEN * len(step)
    if period == 0.0 or often:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    return _gaps(time, period, pause)


def _gaps(time: Times, period: float, pause: float | None) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Gaps in increasing times (n,) as in `gaps_between`: for periodic sampling with `period` [s]; for irregular
    sampling, steps longer than `pause` [s]."""
    step = np.diff(time)
    wide = np.flatnonzero(step > (GAP * period if pause is None else pause))
    lost = np.maximum(np.rint(step[wide] / period - 1.0).astype(np.int64), 1)
    if pause is not None:
        return wide, lost
    real = _not_made_up_for(time, period, wide, lost, CATCHING_UP)
    return wide[real], lost[real]


def _not_made_up_for(
    time: Times, period: float, wide: NDArray[np.int64], lost: NDArray[np.int64], longer: int = 1
) -> NDArray[np.bool_]:
    """Whether the stamps around `wide` steps (w,), with `lost` (w,) apparently missing samples, do not compensate
    them. Behind a step `longer` times as many stamps are looked at as before it."""
    late = time - period * np.arange(len(time))
    real = np.zeros(len(wide), dtype=bool)
    for index, (before, count) in enumerate(zip(wide, 2 * lost + NEIGHBOURS, strict=True)):
        earlier = late[max(before + 1 - count, 0) : before + 1]
        later = late[before + 1 : before + 1 + longer * count]
        share = FULL if min(len(earlier), len(later)) >= count else AT_AN_END
        real[index] = later.min() - earlier.min() > share * period * lost[index]
    return real


def nominal_period(step: Times) -> float:
    """Nominal period from the positive times between samples [s]: the usual step, or the mean one of irregular stamps.

    It is the median, refined over 1, 2, 4, ... steps by the mean of those spans that are within half a period of
    that many periods. The effect of jitter and rounding on the period falls with the length of the span; spans with
    a missing sample are left out. Where delayed messages arrived in bursts, it is the mean step of the usual span
    instead.

    It is rounded to whole nanoseconds, the resolution of stamps, unless the steps are even and rounding would move
    it away from them.
    """
    return _sampling(step)[0]


def _sampling(step: Times) -> tuple[float, float | None]:
    """Nominal period [s] of steps (n,); and for irregular stamps the step [s] above which one is a pause, else None."""
    period, bursts = _usual_step(step)
    if bursts:
        return period, None
    wide, each = _long_steps(step, period)
    gaps = each * float(np.sum(np.maximum(wide - 2.0 * period, 0.0)))
    common = each * len(wide) > COMMON * len(step)
    if not (too_short(step, period, gaps) or (common and irregular(step, period, wide))):
        return period, None
    pause = PAUSE * usual_range(step)[1]
    return round(float(np.mean(step[step <= pause])) * 1e9) * 1e-9, pause


def _long_steps(step: Times, period: float) -> tuple[Times, int]:
    """Steps (g,) that would be gaps of a periodic channel, limited to a sufficient number, and how many each stands for."""
    wide = np.flatnonzero(step > GAP * period)
    each = max(1, math.ceil(len(wide) / JUDGED))
    chosen = wide[::each]
    lost = np.maximum(np.rint(step[chosen] / period - 1.0).astype(np.int64), 1)
    real = _not_made_up_for(np.concatenate([[0.0], np.cumsum(step)]), period, chosen, lost)
    return step[chosen[real]], each


def _usual_step(step: Times) -> tuple[float, bool]:
    """The period of steps (n,), and whether they come in bursts."""
    period = float(
        np.percentile(step, 50.0, method="lower")
    )  # an existing step, where there are two kinds of steps
    time = np.concatenate([[0.0], np.cumsum(step)])
    longest = max(count for count in SPANS if count <= len(step))
    if period < BURSTS * _mean_step(time, longest):
        return _mean_step(time, max(longest, len(step) // PARTS)), True
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


def _mean_step(time: Times, count: int) -> float:
    """Mean step [s] of spans of `count` steps between times (n,), averaged over the middle half of all such spans: a burst may end
    at either end of a span, and the longest spans contain gaps."""
    spans = np.sort(time[count:] - time[:-count])
    quarter = len(spans) // 4
    return float(np.mean(spans[quarter : len(spans) - quarter])) / count


def put_in_order(time: Times, label: str, mend: str) -> NDArray[np.int64]:
    """Indices that sort samples by time; of samples with equal times only the first is kept.

    Messages may overtake one another on their way to the recorder. Such a message is sorted into place if it is at
    most 10 periods late and fills a hole, so that no two samples are closer than half a period. Jittering stamps
    may occasionally be exchanged with their neighbours, and samples that come twice may come late. After any other step backwards the times do not show when a
    sample was taken: a clock was set back, another recording begins, or the rows are mixed up. Then the recording is rejected.

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
        return kept  # no fault of the clock except its jitter
    moved = np.flatnonzero(np.isin(kept, late))
    near = np.concatenate([step[moved[moved > 0] - 1], step[moved[moved < len(step)]]])
    # rows that come twice may also be late; a clock that was set back by k periods gives k - 1 of these for one that is not
    twice, late_twice = np.count_nonzero(time[1:] == newest[:-1]), len(late) - len(moved)
    fills = 2 * late_twice <= twice and (near >= 0.5 * period).all()
    if not fills or (newest[late] - time[late]).max() > LATE * period:
        raise InputError(f"{label}: time goes backwards {_backwards(time)}; {mend}")
    return kept


def _backwards(time: Times) -> str:
    """Where the times (n,) step back, how often, and what that means: runs of rows between such steps are recordings or parts
    of one, single rows are mixed up or damaged."""
    back = 1 + np.flatnonzero(np.diff(time) < 0.0)
    first = int(back[0])
    often = "" if len(back) == 1 else f", the first of {len(back)} times"
    runs = np.diff(np.concatenate([[0], back, [len(time)]]))
    what = (
        "the clock was set back there, or another recording begins"
        if runs.min() >= SHORTEST_RUN
        else "rows are mixed up or damaged: sort them by their time, or delete them, unless the clock was set back"
    )
    return (
        f"by {time[first - 1] - time[first]:.6g} s at {time[first - 1]:.6f} s "
        f"(sample {first + 1} of {len(time)}{often}): {what}"
    )
