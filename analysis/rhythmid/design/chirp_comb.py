"""Time-shifted chirps as a comb: one chirp after another, K of which start at K evenly spread phases of the forcing.

The command repeats after T_c = (n + 1/K) T, so that it has lines only at the multiples of 1/T_c. Over K T_c = (Kn + 1) T the
response of harmonic m falls into bins ≡ m modulo K. These are the paper's shifted chirps, with K ≥ 2M + 1 so that no two responses
coincide. Two more phases leave classes empty, in which noise and distortion show.
"""

import math

import numpy as np

from rhythmid.design.requirements import Requirements
from rhythmid.design.response_lines import ResponseLines
from rhythmid.design.signal_plan import SignalPlan, duration_for, lead_in, shortest_repeat
from rhythmid.errors import InputError
from rhythmid.excitation.chirp import Chirp, Shift

EMPTY = 2  # classes that no harmonic falls into


def chirp_comb(requirements: Requirements, ring_down: float) -> SignalPlan:
    """The longest comb that fits after its lead-in; `ring_down` [s] is the machine's.

    Raises InputError when the run is too short, or when harmonics would coincide.
    """
    pumping = 1.0 / requirements.forcing.frequency
    count = requirements.shifts or 2 * requirements.harmonics + 1 + EMPTY
    available = requirements.duration - lead_in(requirements, ring_down)
    whole = math.floor(available / count / pumping - 1.0 / count + 1e-9)
    least = math.ceil(shortest_repeat(ring_down) / pumping)
    if whole < least:
        needed = duration_for((count * least + 1) * pumping, requirements, ring_down)
        raise InputError(
            f"--duration {requirements.duration:g} s is too short for a comb of {count} chirps, each of which must outlast the "
            f"machine's ring-down; at least {math.ceil(needed)} s are needed"
        )
    periods = count * whole + 1
    repeat = periods * pumping / count
    sweep = whole * pumping
    low, high = requirements.band
    # whole chirps: each ends at zero, without a jump
    cycles = max(1, math.floor(0.5 * (low + high) * sweep + 1e-9))
    high = max(2.0 * cycles / sweep - low, low + 1.0 / sweep)
    teeth = count * np.arange(max(1, math.ceil(low * repeat - 1e-9)), math.floor(high * repeat + 1e-9) + 1)
    # a line at a harmonic of the cycle carries no information and is not used
    teeth = teeth[teeth % periods != 0]
    response = ResponseLines(
        teeth.astype(np.int64), periods, 1.0 / (periods * pumping), requirements.harmonics
    )
    response.require_separate(f"use at least {2 * requirements.harmonics + 1} shifts")
    comb = Chirp(
        amplitude=1.0, band=(low, high), sweep=sweep, shift=Shift(period=pumping, count=count),
        repetitions=math.ceil(requirements.duration / repeat) + 1,
    )  # fmt: skip
    facts = {
        "chirps": count, "sweep": sweep, "highest": high, "repeat": repeat,
        "empty_classes": count - 2 * requirements.harmonics - 1,
    }  # fmt: skip
    return SignalPlan(
        comb, repeat, periods * pumping, requirements.duration - periods * pumping, response, facts
    )
