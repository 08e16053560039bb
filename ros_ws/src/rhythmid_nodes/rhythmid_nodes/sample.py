"""A sample of one joint."""

from __future__ import annotations

from typing import NamedTuple


class Sample(NamedTuple):
    """The values of one joint in a message; NaN if absent. SI: ns since the epoch, m, m/s, N."""

    stamp_ns: int
    position: float
    velocity: float
    effort: float
