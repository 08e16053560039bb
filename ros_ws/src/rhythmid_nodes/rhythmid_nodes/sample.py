"""A sample of one joint."""

from __future__ import annotations

from typing import NamedTuple


class Sample(NamedTuple):
    """What a message says of one joint; NaN where it says nothing. SI: ns since the epoch, m, m/s, N."""

    stamp_ns: int
    position: float
    velocity: float
    effort: float
