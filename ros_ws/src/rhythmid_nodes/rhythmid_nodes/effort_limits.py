"""Limits of the effort, whichever node commands: its size, its rate of change, and its power."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class EffortLimits:
    """Limits in SI units; infinite limits have no effect.

    Attributes
    ----------
    size : largest |u| [N or N m].
    rate : largest |du/dt| [N/s or N m/s].
    power : largest |u v| [W].
    """

    size: float = math.inf
    rate: float = math.inf
    power: float = math.inf

    def apply(self, effort: float, before: float, elapsed: float, speed: float = 0.0) -> float:
        """The permitted effort in the place of `effort`.

        Parameters
        ----------
        effort : wanted [N].
        before : given last [N].
        elapsed : since then [s].
        speed : of the joint [m/s]; NaN if unknown: then only zero effort satisfies a finite limit of power.

        Notes
        -----
        If the limits contradict each other (the speed grows faster than the effort may fall), power and size have precedence.
        """
        bound = self.size
        if self.power < math.inf:
            bound = min(bound, _largest_at(speed, self.power))
        if self.rate < math.inf:
            step = self.rate * elapsed
            effort = min(max(effort, before - step), before + step)
        return min(max(effort, -bound), bound)


def _largest_at(speed: float, power: float) -> float:
    """The largest effort [N] that takes no more than `power` [W] at `speed` [m/s]."""
    if math.isnan(speed):
        return 0.0
    return power / abs(speed) if speed else math.inf
