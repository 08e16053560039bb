"""Inversion along a trajectory: what must go in, at every instant, for a given signal to come out."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST_INVERSION_STEPS = 12  # steps at most: an error that halves each time is then below a thousandth
SETTLING = 0.5  # of its error that a correction has to leave at most: a limit of rate, which cannot be inverted, leaves nearly all
FAST = 0.1  # of its error that a step leaves, up to which the slopes of the one before do for the next: they cost two runs
EXACT = 1e-6  # of a signal: as near as an inversion goes
LEAST_SHARE = 0.2  # of a step that is tried: a slope that grows fivefold on the way is still followed
SECANT = 1e-3  # of a signal, over which a slope is taken
FLAT = 0.05  # of its usual slope, below which an element counts as passing nothing on
NO_SLOPE = 1e-9  # below which a slope is the rounding of what comes out, over a secant of `SECANT`


@dataclass(frozen=True, eq=False)
class Inverted:
    """What goes in, `into` (n,), and the `error` (n,) of what then comes out. `slope` (n,) is that of what comes out over what goes in;
    None where it was not asked for, or where what comes out does not depend on the same instant alone."""

    into: Array
    error: Array
    slope: Array | None = None


def inverted(
    comes_out: Callable[[Array], Array], wanted: Array, remembers: bool, with_slope: bool = False
) -> Inverted:
    """What goes in for `wanted` (n,) to come out.

    Newton's steps at each instant where what comes out depends on that instant alone; where it `remembers`, the change on the way is
    taken off again as long as that settles. Where nothing is passed on, in a dead band or beyond a limit, it is what goes in to first order.
    """
    into, error = wanted, wanted - comes_out(wanted)
    first_order, least = wanted + error, EXACT * np.linalg.norm(wanted)
    slope: Array | None = None
    share = np.ones(len(wanted))  # of a step, halved where it led too far: where the slope grows on the way
    reached = np.ones(len(wanted), dtype=bool)  # by what goes in
    for _ in range(MOST_INVERSION_STEPS):
        step = error
        if not remembers:
            slope = _slope(comes_out, into) if slope is None else slope
            reached = slope != 0.0
            step = share * np.divide(error, slope, out=np.zeros_like(error), where=reached)
        left = wanted - comes_out(into + step)
        if np.linalg.norm(left[reached]) > FAST * np.linalg.norm(error[reached]):
            slope = None  # the last one leads too slowly
        if remembers:
            nearer = np.full(len(wanted), np.linalg.norm(left) < SETTLING * np.linalg.norm(error))
        else:
            nearer = np.abs(left) < np.abs(error)
        into, error = np.where(nearer, into + step, into), np.where(nearer, left, error)
        share = np.where(nearer, 1.0, 0.5 * share)
        stands = not nearer.any() and (remembers or share.max() < LEAST_SHARE)
        if stands or np.linalg.norm(error[reached]) <= least:
            break
    last = _slope(comes_out, into) if with_slope and not remembers else None
    return Inverted(np.where(into == wanted, first_order, into), error, last)


def followed(
    known: Inverted, comes_out: Callable[[Array], Array], wanted: Array, remembers: bool
) -> Inverted:
    """What goes in for `wanted` (n,) to come out where both differ little from those of a `known` inversion: to first order, in one run
    of what comes out. All over again where nothing is passed on somewhere, or where the slope is not known."""
    if known.slope is None or not known.slope.all():
        return inverted(comes_out, wanted, remembers)
    step = (wanted - comes_out(known.into) - known.error) / known.slope
    return Inverted(known.into + step, known.error)


@dataclass(frozen=True, eq=False)
class Inversions:
    """The inversions on the way from the forces of one motion to its effort: those `made`, by the element that was inverted ("" for the
    forces that the effort loads), and those `known` of a model with nearly the same values, which are followed."""

    known: Mapping[str, Inverted] = field(default_factory=dict)
    made: dict[str, Inverted] = field(default_factory=dict)
    with_slopes: bool = False

    def inverted(
        self, label: str, comes_out: Callable[[Array], Array], wanted: Array, remembers: bool
    ) -> Array:
        """What goes in (n,) for `wanted` (n,) to come out."""
        if label in self.known:
            found = followed(self.known[label], comes_out, wanted, remembers)
        else:
            found = inverted(comes_out, wanted, remembers, self.with_slopes)
        self.made[label] = found
        return found.into


def _slope(comes_out: Callable[[Array], Array], signal: Array) -> Array:
    """Slope (n,) of what comes out over what goes in; 0 where hardly anything more comes out than usually does where something does."""
    width = SECANT * (float(np.std(signal)) or 1.0)
    slope = (comes_out(signal + 0.5 * width) - comes_out(signal - 0.5 * width)) / width
    passing = np.abs(slope) > NO_SLOPE
    usual = float(np.median(slope[passing])) if passing.any() else 1.0
    return np.where(passing & (slope / usual > FLAT), slope, 0.0)
