"""Messages about the clocks of channels, and the assumptions made about them."""

import math
from collections.abc import Mapping

from rhythmid.record.quality import ChannelQuality

# [s] difference of two channels' latencies above which their stamps hardly come from one clock
CLOCKS_APART = 1.0
APART_BY = 5.0  # standard deviations above which two clocks are reported to drift apart
TIMES = {
    "receive": "time of receipt",
    "sent": "time of sending",
    "header": "stamps",
}  # kinds of a bag's times
WORTH_TELLING = 0.1  # drift over a record in sample periods; a smaller one affects no delay


def clock_notes(channels: Mapping[str, ChannelQuality], clocks: Mapping[str, str]) -> tuple[str, ...]:
    """Notes on the clocks of channels by role; `clocks` says for each channel of what kind its times are."""
    return (
        *_different(channels),
        *assumed_clock(channels, clocks),
        *_running_apart(channels, clocks),
        *_jittered(channels),
    )


def _different(channels: Mapping[str, ChannelQuality]) -> tuple[str, ...]:
    """A note if channels are stamped by clocks that cannot be the same."""
    age = {
        role: channel.lateness_mean for role, channel in channels.items() if channel.lateness_mean is not None
    }
    if not age or max(age.values()) - min(age.values()) < CLOCKS_APART:
        return ()
    told = ", ".join(f"{role} {seconds:.6g} s" for role, seconds in age.items())
    return (f"stamps of different clocks: received after their stamps by {told}; use  time: receive",)


def assumed_clock(channels: Mapping[str, ChannelQuality], clocks: Mapping[str, str]) -> tuple[str, ...]:
    """Assumption where channels of a bag have times of different kinds."""
    kinds = [kind for kind in TIMES if kind in clocks.values()]
    if len(kinds) < 2 or not set(clocks.values()) <= set(TIMES):
        return ()
    told = (
        f"{' and '.join(role for role, own in clocks.items() if own == kind)} ({TIMES[kind]})"
        for kind in kinds
    )
    older = ""
    if "receive" in kinds:
        stamped = [role for role, kind in clocks.items() if kind != "receive"]
        least = min(found for role in stamped if (found := channels[role].lateness_min) is not None)
        older = f"the stamps are at least {1e3 * least:.3g} ms older than their receipt, and "
    return (
        f"assumed: {' and '.join(told)} share one clock; {older}an offset between the clocks counts as delay",
    )


def assumed_columns(columns: Mapping[str, str]) -> tuple[str, ...]:
    """Assumption where channels of tables have times in different columns; `columns` says for each by role in which."""
    names = list(dict.fromkeys(columns.values()))
    if len(names) < 2:
        return ()
    told = " and ".join(
        f"{', '.join(role for role, own in columns.items() if own == name)} (times in {name})"
        for name in names
    )
    return (f"assumed: {told} share one clock; an offset between the clocks counts as delay",)


def _running_apart(channels: Mapping[str, ChannelQuality], clocks: Mapping[str, str]) -> tuple[str, ...]:
    """Notes on channels whose clock drifts relative to that of the output, according to receive times."""
    rates = {role: _rate(channel, clocks.get(role)) for role, channel in channels.items()}
    own = rates.get("output")
    if own is None:
        return ()
    timing, found = channels["output"].timing, []
    for role, other in rates.items():
        if role == "output" or other is None:
            continue
        apart, std = own[0] - other[0], math.hypot(own[1], other[1])
        grown = abs(apart) * (timing.end - timing.start)
        if abs(apart) > APART_BY * std and grown > WORTH_TELLING * timing.period:
            found.append(
                f"the clock of the output drifts by {1e6 * apart:+.3g} ± {1e6 * std:.1g} µs/s against that of the {role}, judged by the times "
                f"of receipt ({1e3 * grown:.3g} ms over the record); use  time: receive  for both"
            )
    return tuple(found)


def _rate(channel: ChannelQuality, clock: str | None) -> tuple[float, float] | None:
    """Rate [s/s] by which a channel's times run faster than the receiver's clock, with its standard deviation [s/s]."""
    if clock == "receive":
        return 0.0, 0.0
    return None if channel.skew is None or channel.skew_std is None else (channel.skew, channel.skew_std)


def _jittered(channels: Mapping[str, ChannelQuality]) -> tuple[str, ...]:
    """A note for a channel with so much timestamp jitter that its noise grows with the slope of the signal."""
    return tuple(
        f"{role}: the stamps jitter by {1e3 * channel.stamp_jitter:.3g} ± {1e3 * channel.stamp_jitter_std:.1g} ms; samples count for "
        "less the faster the signal changes"
        for role, channel in channels.items()
        if channel.stamp_jitter is not None and channel.stamp_jitter_std is not None
    )
