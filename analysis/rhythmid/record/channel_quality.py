"""Quality of one channel as it was recorded."""

import numpy as np
from numpy.typing import NDArray

from rhythmid.record.clock_skew import clock_skew
from rhythmid.record.placeholder import Placeholder
from rhythmid.record.quality import ChannelQuality, clipped
from rhythmid.record.rounding import shown_resolution
from rhythmid.record.stamp_jitter import stamp_jitter
from rhythmid.record.timing import Timing

Array = NDArray[np.float64]


def channel_quality(
    source: str,
    recorded: Array,
    lateness: NDArray[np.floating] | None,
    time: Array,
    value: Array,
    stamped: bool,
    missing: int,
    conflicts: int,
    placeholder: Placeholder | None = None,
) -> ChannelQuality:
    """Quality of a channel.

    Parameters
    ----------
    source : origin of the channel.
    recorded, lateness : (m,) times [s] in the order of recording, and receive time minus stamp [s]; None without stamps.
    time, value : (n,) times [s] in order, without duplicates, and values; NaN where one is missing.
    stamped : whether it is the output with its own stamps, whose jitter the samples show; a declared rate gives no
        stamps.
    missing, conflicts : messages without the channel's entry, and duplicates with different values.
    placeholder : the samples that hold a placeholder, whose value is NaN.
    """
    told = np.isfinite(value)  # infinite values are rejected where they are used
    present = value[told]
    skew = None if lateness is None else clock_skew(recorded, lateness)
    jitter = stamp_jitter([(time[told], present)]) if stamped else None
    return ChannelQuality(
        source,
        Timing.of(recorded),
        nan=max(0, int(np.isnan(value).sum()) - (0 if placeholder is None else placeholder.count)),
        placeholders=0 if placeholder is None else placeholder.count,
        placeholder="" if placeholder is None else placeholder.words,
        clipped=clipped(present),
        missing=missing,
        conflicts=conflicts,
        lateness_mean=None if lateness is None else float(lateness.mean()),
        lateness_max=None if lateness is None else float(lateness.max()),
        lateness_min=None if lateness is None else float(lateness.min()),
        lateness_std=None if lateness is None else float(lateness.std()),
        skew=None if skew is None else skew.rate,
        skew_std=None if skew is None else skew.std,
        stamp_jitter=None if jitter is None else jitter.std,
        stamp_jitter_std=None if jitter is None else jitter.uncertainty,
        resolution=shown_resolution(present),
    )
