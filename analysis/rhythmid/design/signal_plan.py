"""What both kinds of signal have in common: a command that repeats, a lead-in until the response does, a window after it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rhythmid.design.requirements import Requirements
from rhythmid.design.response_lines import ResponseLines
from rhythmid.excitation.excitation import Excitation
from rhythmid.ltp.spectra import RING_DOWNS

LONGEST_LEAD_IN = 0.25  # of the duration


@dataclass(frozen=True, eq=False)
class SignalPlan:
    """A command of any size, to be scaled.

    `repeat` [s] after which the command is the same again; `repeats` of them, or of a whole comb, make the window over
    which `response` tells where its lines fall; `lead_in` [s] comes before. `facts` are what is worth telling of it.
    """

    excitation: Excitation
    repeat: float
    window: float
    lead_in: float
    response: ResponseLines
    facts: Mapping[str, Any]


def lead_in(requirements: Requirements, ring_down: float) -> float:
    """Time [s] until the response repeats: twelve ring-downs, at most a quarter of the run, and the delays."""
    settling = min(RING_DOWNS * ring_down, LONGEST_LEAD_IN * requirements.duration)
    return settling + 2.0 * requirements.longest_delay


def shortest_repeat(ring_down: float) -> float:
    """π τ [s]: then the lines are as close as a resonance that rings down with τ is wide at half its power."""
    return math.pi * ring_down


def duration_for(window: float, requirements: Requirements, ring_down: float) -> float:
    """Shortest run [s] that holds such a window [s] after its lead-in."""
    needed = window + 2.0 * requirements.longest_delay
    return min(needed + RING_DOWNS * ring_down, needed / (1.0 - LONGEST_LEAD_IN))
