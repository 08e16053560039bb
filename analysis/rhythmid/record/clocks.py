"""What the times of channels tell of their clocks, and what has to be assumed."""

from collections.abc import Mapping

from rhythmid.record.quality import ChannelQuality

# seconds between the ages at receipt of two channels, from which their stamps hardly share a clock
CLOCKS_APART = 1.0


def clock_notes(channels: Mapping[str, ChannelQuality], clocks: Mapping[str, str]) -> tuple[str, ...]:
    """Notes on the clocks of channels by role; `clocks` says whether their times are those of `header` or `receive`."""
    return (*_different(channels), *_assumed(channels, clocks), *_jittered(channels))


def _different(channels: Mapping[str, ChannelQuality]) -> tuple[str, ...]:
    """A note if channels are stamped by clocks that cannot be the same."""
    age = {
        role: channel.lateness_mean for role, channel in channels.items() if channel.lateness_mean is not None
    }
    if not age or max(age.values()) - min(age.values()) < CLOCKS_APART:
        return ()
    told = ", ".join(f"{role} {seconds:.6g} s" for role, seconds in age.items())
    return (f"stamps of different clocks: received after their stamps by {told}; use  time: receive",)


def _assumed(channels: Mapping[str, ChannelQuality], clocks: Mapping[str, str]) -> tuple[str, ...]:
    """What is assumed where some channels have the times of their stamps and others those of their receipt."""
    if set(clocks.values()) != {"header", "receive"}:
        return ()
    received = " and ".join(role for role, kind in clocks.items() if kind == "receive")
    stamped = [role for role, kind in clocks.items() if kind == "header"]
    least = min(found for role in stamped if (found := channels[role].lateness_min) is not None)
    return (
        f"assumed: {received} (time of receipt) and {' and '.join(stamped)} (stamps) share one clock; the stamps are at least "
        f"{1e3 * least:.3g} ms older than their receipt, and an offset between the clocks counts as delay",
    )


def _jittered(channels: Mapping[str, ChannelQuality]) -> tuple[str, ...]:
    """A note for a channel whose stamps are out by so much that its noise grows with the slope of the signal."""
    return tuple(
        f"{role}: the stamps jitter by {1e3 * channel.stamp_jitter:.3g} ± {1e3 * channel.stamp_jitter_std:.1g} ms; samples count for "
        "less the faster the signal changes"
        for role, channel in channels.items()
        if channel.stamp_jitter is not None and channel.stamp_jitter_std is not None
    )
