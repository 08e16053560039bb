"""Common parts of both kinds of signal: a repeated command, a lead-in until the response repeats, and a window after it."""

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
    """A command of arbitrary size, to be scaled.

    The command repeats after `repeat` [s]. `repeats` repetitions, or a whole comb, form the window in which `response` tells the
    bins of the response lines. `lead_in` [s] comes before. `facts` are notes for the user.
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
    """π τ [s]: the line spacing then equals the half-power width of a resonance that rings down with the time constant τ."""
    return math.pi * ring_down


def duration_for(window: float, requirements: Requirements, ring_down: float) -> float:
    """Shortest run [s] that holds this window [s] after its lead-in."""
    needed = window + 2.0 * requirements.longest_delay
    return min(needed + RING_DOWNS * ring_down, needed / (1.0 - LONGEST_LEAD_IN))
