"""Data quality of a record: properties that affect the reliability of results identified from it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.rounding import resolution
from rhythmid.record.timing import Timing

# least size (rms) of the steps beside a plateau, relative to the usual step, for a motion that continues: a sine
# clipped at 99 % of its size has 0.2 there, one that comes to rest has none
MOVING = 0.05
CLIPPED_RUN = 4  # consecutive samples at the extreme value
CLIPPED_EXCESS = 5  # ratio of samples in such runs to samples at the next value


@dataclass(frozen=True)
class ChannelQuality:
    """Quality of one channel.

    Attributes
    ----------
    source : origin of the channel.
    timing : of its samples, as recorded.
    nan : samples that are not a number (NaN, or an empty field of a table) and count as missing.
    placeholders, placeholder : samples that hold a number for "nothing measured" and count as missing, and that
        number as recorded; see `placeholder_of`.
    clipped : samples in runs at the largest or smallest value, as caused by a limit.
    missing : messages without the channel's entry, such as those of another joint.
    conflicts : duplicates with different values.
    lateness_mean, lateness_max, lateness_min, lateness_std : receive time minus header stamp [s], the last its
        jitter; None without header stamps.
    skew, skew_std : rate by which the stamping clock runs faster than the receiver's clock [s/s], and its standard
        deviation; None where it is not observable. See `clock_skew`.
    stamp_jitter, stamp_jitter_std : standard deviation of the stamp jitter estimated from the samples [s], and its
        uncertainty [s] (a standard deviation); None where none is detected. See `stamp_jitter`.
    resolution : rounding step of its values in its unit, the coarsest where it depends on their size; 0 where none is
        detected.
    """

    source: str
    timing: Timing
    nan: int = 0
    clipped: int = 0
    missing: int = 0
    conflicts: int = 0
    lateness_mean: float | None = None
    lateness_max: float | None = None
    lateness_min: float | None = None
    lateness_std: float | None = None
    skew: float | None = None
    skew_std: float | None = None
    stamp_jitter: float | None = None
    stamp_jitter_std: float | None = None
    resolution: float = 0.0
    placeholders: int = 0
    placeholder: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON, including the timing."""
        values = asdict(self)
        return {"source": values.pop("source"), "rate": self.timing.rate, **values.pop("timing"), **values}

    def facts(self) -> list[str]:
        """Rate, jitter of its times (for irregular ones their usual steps) and of its arrival, and rounding, one
        phrase each."""
        timing = self.timing
        found = [timing.told_rate] if timing.rate > 0.0 else []
        if timing.jitter_std > 0.0 and timing.usual_range is None:
            found.append(f"jitter of its times {timing.jitter_std:.2g} s")
        if self.lateness_std is not None:
            found.append(f"jitter of its arrival {self.lateness_std:.2g} s")
        if self.stamp_jitter is not None and self.stamp_jitter_std is not None:
            found.append(f"jitter of its stamps {self.stamp_jitter:.2g} ± {self.stamp_jitter_std:.1g} s")
        if self.resolution > 0.0:
            found.append(f"rounded to {self.resolution:.4g}")
        return found

    def complaints(self) -> list[str]:
        """Defects of the channel, one phrase each; empty for a flawless channel."""
        timing = self.timing
        found = {
            f"{timing.gaps} gaps, {timing.lost} samples lost, longest {timing.longest_gap:.4g} s": timing.gaps,
            f"{timing.duplicates} duplicates, {self.conflicts} of them with other values: of equal times the first sample is kept": timing.duplicates,
            f"{timing.late} samples out of order, sorted by their times": timing.late,
            f"{self.nan} samples are NaN or empty and count as missing": self.nan,
            f"{self.placeholders} samples hold {self.placeholder} for nothing measured and count as missing": self.placeholders,
            f"{self.clipped} samples look clipped": self.clipped,
            f"{self.missing} messages without this entry": self.missing,
        }
        return [phrase for phrase, count in found.items() if count]

    def matters(self) -> list[str]:
        """The complaints that may change a result: without missing entries, equal duplicates and reordered messages."""
        harmless = replace(self, missing=0, timing=replace(self.timing, late=0))
        if not self.conflicts:
            harmless = replace(harmless, timing=replace(harmless.timing, duplicates=0))
        return harmless.complaints()


@dataclass(frozen=True)
class Quality:
    """Quality of a record, channel by channel; `truncated` if the recording is incomplete; `notes` one line each.

    `assumed` are the notes about assumptions of the signals.yaml rather than faults of the recording.
    """

    channels: Mapping[str, ChannelQuality]
    truncated: bool = False
    notes: tuple[str, ...] = field(default_factory=tuple)
    assumed: tuple[str, ...] = field(default_factory=tuple)

    @property
    def rate(self) -> float:
        """Nominal rate of the output [Hz]."""
        return self.channels["output"].timing.rate

    @property
    def jitter_std(self) -> float:
        """Jitter of the output's times [s]."""
        return self.channels["output"].timing.jitter_std

    @property
    def gaps(self) -> int:
        """Gaps of the output. Channels of one table share their gaps, which must not be counted for each."""
        return self.channels["output"].timing.gaps

    @property
    def lost(self) -> int:
        """Samples of the output that were lost."""
        return self.channels["output"].timing.lost

    @property
    def duplicates(self) -> int:
        """Duplicates of the output, which were dropped."""
        return self.channels["output"].timing.duplicates

    @property
    def clipped(self) -> int:
        """Samples that look clipped in all channels."""
        return sum(channel.clipped for channel in self.channels.values())

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON."""
        return {
            "rate": self.rate,
            "gaps": self.gaps,
            "lost": self.lost,
            "duplicates": self.duplicates,
            "jitter_std": self.jitter_std,
            "clipped": self.clipped,
            "truncated": self.truncated,
            "notes": list(self.notes),
            "channels": {role: channel.to_dict() for role, channel in self.channels.items()},
        }

    def warnings(self) -> list[str]:
        """Defects of all channels, one line each."""
        return [
            *self.notes,
            *(
                f"{role}: {phrase}"
                for role, channel in self.channels.items()
                for phrase in channel.complaints()
            ),
        ]


def clipped(value: NDArray[np.float64]) -> int:
    """Number of samples in runs of at least 4 at the largest or smallest value; see `clipped_samples`."""
    return int(np.count_nonzero(clipped_samples(value)))


def clipped_samples(value: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether samples lie in runs of at least 4 at the largest or smallest value, as caused by a limit.

    Coarse rounding and plateaus also cause such runs. Clipping is reported only if the next value inwards is far
    rarer than the extreme one, because a signal that passes through has no reason to be. Signals with few levels
    have no such next value. A machine that comes to rest at other positions as often and for as long may rest at
    its extremes, too.
    """
    if len(value) < CLIPPED_RUN:
        return np.zeros(len(value), dtype=bool)
    return _at_limit(value) | _at_limit(-value)


def _at_limit(value: NDArray[np.float64]) -> NDArray[np.bool_]:
    found = np.zeros(len(value), dtype=bool)
    top = value.max()
    at_top = value == top
    if at_top.sum() < CLIPPED_RUN:
        return found
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at_top, [False]])))
    runs = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2])]
    for begin, end in runs:
        found[begin:end] = end - begin >= CLIPPED_RUN
    below = value.max(where=~at_top, initial=-math.inf)
    at_ends = (
        at_top[0] and at_top[-1] and len(runs) <= 2
    )  # at rest before and after: a limit would act in between
    few_levels = below == -math.inf or value.min() == below
    if few_levels or at_ends or found.sum() <= CLIPPED_EXCESS * np.sum(value == below):
        return np.zeros(len(value), dtype=bool)
    runs = [(begin, end) for begin, end in runs if end - begin >= CLIPPED_RUN]
    if _rests(value, runs) or not _moving(value, runs):
        return np.zeros(len(value), dtype=bool)
    return found


def _rests(value: NDArray[np.float64], runs: list[tuple[int, int]]) -> bool:
    """Whether a signal (n,) keeps values between its extremes as often as in these runs, for about as long, and as suddenly:
    a machine that sticks by friction slows down before. Values before its first and after its last move are ignored,
    because any signal rests there."""
    changes = np.flatnonzero(np.diff(value)) + 1
    lengths, level = np.diff(changes), value[changes[:-1]]
    about = 0.5 * float(np.median([end - begin for begin, end in runs]))
    between = (lengths >= about) & (level > value.min()) & (level < value.max())
    rests = [
        (int(begin), int(begin + length)) for begin, length in zip(changes[:-1][between], lengths[between])
    ]
    return len(rests) >= len(runs) and sum(map(_at_speed(value), rests)) >= len(runs)


def _moving(value: NDArray[np.float64], runs: list[tuple[int, int]]) -> bool:
    """Whether a signal (n,) both enters and leaves its plateaus at speed, as a clipped signal does."""
    if not np.diff(value).any():
        return False
    speeds = [_speeds(np.abs(np.diff(value)), run) for run in runs]
    entries = [before for before, _ in speeds if before is not None]
    exits = [after for _, after in speeds if after is not None]
    least = _least_speed(value)
    return all(ends and float(np.median(ends)) > least for ends in (entries, exits))


def _at_speed(value: NDArray[np.float64]) -> Callable[[tuple[int, int]], bool]:
    """Whether a run of a signal (n,) is entered and left at speed, by its first sample and the one after its last."""
    step, least = np.abs(np.diff(value)), _least_speed(value)
    return lambda run: all(speed is not None and speed > least for speed in _speeds(step, run))


def _speeds(step: NDArray[np.float64], run: tuple[int, int]) -> tuple[float | None, float | None]:
    """Smaller of the two steps (n - 1,) before and after a run, without those into and out of it, which a limit
    shortens; None at an end of the signal.

    Two steps in a row are a motion: a limit knows nothing of it, so a signal that it cuts is under way before and goes
    on after. A machine that comes to rest by friction slows down, one that hits a stop starts from rest, and a jump from
    one rest to another is over in as long as it takes to see it.
    """
    begin, end = run
    before = float(min(step[begin - 3], step[begin - 2])) if begin >= 3 else None
    after = float(min(step[end], step[end + 1])) if end + 1 < len(step) else None
    return before, after


def _least_speed(value: NDArray[np.float64]) -> float:
    """Step from which on a signal (n,) moves at speed; one of a rounded value may be a slow drift."""
    moves = np.diff(value)
    usual = float(np.sqrt(np.mean(moves[moves != 0.0] ** 2)))
    return max(MOVING * usual, 1.5 * resolution(value))
