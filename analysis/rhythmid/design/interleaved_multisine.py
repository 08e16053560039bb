"""Interleaved multisine: equally spaced odd lines, placed so that every response line belongs to one line and one harmonic.

The period holds an even number P of pumping periods. The responses of odd lines at all harmonics are therefore odd, and even
distortion falls on even bins. One of every four lines, drawn at random, is left out; a response there is odd distortion
(the random-odd grid of R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012,
section 4.3). Equal spacing allows a small crest factor.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rhythmid.design.crest_factor import least_crest
from rhythmid.design.requirements import Requirements
from rhythmid.design.response_lines import Lines, ResponseLines
from rhythmid.design.signal_plan import SignalPlan, duration_for, lead_in, shortest_repeat
from rhythmid.errors import InputError
from rhythmid.excitation.multisine import Multisine

REPEATS = 2  # repetitions of the period: differences between them are noise
GROUP = 4  # lines in a group, one of which is left out
FEWEST_LINES = 4  # minimum number of lines


def _pumping_periods(requirements: Requirements, ring_down: float) -> tuple[int, int]:
    """Even number P of pumping periods in the multisine's period, and its repeats. Raises InputError where none fits."""
    frequency = requirements.grid
    available = (requirements.duration - lead_in(requirements, ring_down)) * frequency
    least = 2 * math.ceil(0.5 * shortest_repeat(ring_down) * frequency)
    if requirements.period is not None:
        exact = requirements.period * frequency
        periods = round(exact)
        if abs(exact - periods) > 1e-6 or periods % 2 or periods < 2:
            near = max(2, 2 * round(0.5 * exact)) / frequency
            raise InputError(
                f"--period {requirements.period:g} s aliases: it does not hold an even number of "
                f"{'forcing periods' if requirements.forced else 'pairs of samples'} of {1.0 / frequency:g} s, so sidebands fall between the lines or on them; the nearest that does is {near:g} s"
            )
        repeats = math.floor(available / periods + 1e-9)
        needed = periods
    else:
        repeats = REPEATS if available >= REPEATS * least else 1
        periods = 2 * math.floor(0.5 * available / repeats + 1e-9)
        needed = least
    if requirements.period is not None and periods < least:
        raise InputError(
            f"--period {requirements.period:g} s is too short: the machine's ring-down asks for {least / frequency:g} s at least"
        )
    if repeats < 1 or periods < least:
        longer = math.ceil(duration_for(needed / frequency, requirements, ring_down))
        raise InputError(
            f"--duration {requirements.duration:g} s is too short for a multisine of {needed / frequency:g} s behind a lead-in "
            f"that lets the machine settle; at least {longer} s are needed"
        )
    return periods, repeats


def spaced_lines(first: int, last: int, spacing: int) -> Lines:
    """Every `spacing`-th bin from `first` to `last`."""
    return np.arange(first, last + 1, spacing)


def closest_lines(low: int, high: int, periods: int, harmonics: int, spacings: range) -> Lines | None:
    """The most closely spaced odd lines in bins low … high whose responses all have separate bins.

    None where there are fewer than `FEWEST_LINES` of them.
    """
    for spacing in spacings:
        for first in range(low | 1, min(low + spacing, high) + 1, 2):
            lines = spaced_lines(first, high, spacing)
            if len(lines) >= FEWEST_LINES and ResponseLines(lines, periods, 1.0, harmonics).separate:
                return lines
    return None


def thinned(lines: Lines, seed: int) -> Lines:
    """The lines without one of every four, drawn at random, so that odd distortion shows; all lines where they are few."""
    if len(lines) < 2 * GROUP:
        return lines
    rng = np.random.default_rng(seed)
    out = [group + int(rng.integers(1, GROUP)) for group in range(0, len(lines) - GROUP + 1, GROUP)]
    return np.delete(lines, out)


@dataclass(frozen=True, eq=False)
class Interleaving:
    """Equally `spaced` lines and the excited `lines` among them, as multiples of 1/period.

    The period holds `periods` P pumping periods and is repeated `repeats` times.
    """

    spaced: Lines
    lines: Lines
    periods: int
    repeats: int


def interleaved(requirements: Requirements, ring_down: float) -> Interleaving:
    """The most closely spaced lines of the longest period that fits twice after its lead-in; `ring_down` [s] is the machine's.

    Raises InputError when the run is too short, or when responses would coincide.
    """
    periods, repeats = _pumping_periods(requirements, ring_down)
    period = periods / requirements.grid
    low = max(1, math.ceil(requirements.band[0] * period - 1e-9))
    high = math.floor(requirements.band[1] * period + 1e-9)
    harmonics = requirements.harmonics
    if requirements.spacing is None:
        spaced = closest_lines(low, high, periods, harmonics, range(2, max(3, high - low), 2))
        if spaced is None:
            raise InputError(
                f"the design aliases: no {FEWEST_LINES} lines between {requirements.band[0]:g} and {requirements.band[1]:g} Hz with a "
                f"period of {period:g} s keep their sidebands up to ±{harmonics} apart; use a longer --duration, a wider "
                "--band or fewer --harmonics"
            )
    else:
        spacing = 2 * round(0.5 * requirements.spacing * period)
        if spacing < 2 or len(spaced_lines(low | 1, high, max(spacing, 2))) < FEWEST_LINES:
            raise InputError(
                f"--spacing {requirements.spacing:g} Hz leaves fewer than {FEWEST_LINES} odd lines of 1/{period:g} Hz in the band"
            )
        spaced = closest_lines(low, high, periods, harmonics, range(spacing, spacing + 1))
        if spaced is None:
            spaced = spaced_lines(low | 1, high, spacing)
            response = ResponseLines(spaced, periods, 1.0 / period, harmonics)
            response.require_separate("leave out --spacing and the closest that does not alias is chosen")
    return Interleaving(spaced, thinned(spaced, requirements.seed), periods, repeats)


def interleaved_multisine(
    requirements: Requirements, ring_down: float, progress: Callable[[str], None] | None = None
) -> SignalPlan:
    """The multisine of these lines with a small crest factor. Raises InputError as `interleaved` does."""
    made = interleaved(requirements, ring_down)
    lines, period = made.lines, made.periods / requirements.grid
    weights = np.ones(len(lines))
    _, phases = least_crest(lines, weights, requirements.seed, progress)
    sine = Multisine(
        rms=1.0, period=period, periods=math.ceil(requirements.duration / period),
        lines=tuple(int(k) for k in lines), weights=tuple(weights), phases=tuple(float(p) for p in phases),
    )  # fmt: skip
    window = made.repeats * period
    response = ResponseLines(
        made.repeats * lines, made.repeats * made.periods, 1.0 / window, requirements.harmonics
    )
    facts = {
        "period": period, "repeats": made.repeats, "lines": len(lines),
        "spacing": float(made.spaced[1] - made.spaced[0]) / period,
        "left_out": [float(k / period) for k in np.setdiff1d(made.spaced, lines)],
    }  # fmt: skip
    return SignalPlan(sine, period, window, requirements.duration - window, response, facts)
