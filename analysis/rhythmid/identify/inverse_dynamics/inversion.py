"""Inversion along a trajectory: what must go in, at every instant, for a given signal to come out."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST = 8  # steps at most: an error that halves each time is then below a hundredth
SETTLING = 0.5  # of its error that a correction has to leave at most: a limit of rate, which cannot be inverted, leaves nearly all
FAST = 0.1  # of its error that a step leaves, up to which the slopes of the one before do for the next: they cost two runs
EXACT = 1e-6  # of a signal: as near as an inversion goes
SECANT = 1e-3  # of a signal, over which a slope is taken
FLAT = 0.05  # of its usual slope, below which an element counts as passing nothing on
NO_SLOPE = 1e-9  # below which a slope is the rounding of what comes out, over a secant of `SECANT`


def inverted(comes_out: Callable[[Array], Array], wanted: Array, remembers: bool) -> Array:
    """What goes in (n,) for `wanted` (n,) to come out.

    Newton's steps at each instant where what comes out depends on that instant alone; where it `remembers`, the change on the way is
    taken off again as long as that settles. Where nothing is passed on, in a dead band or beyond a limit, it is what goes in to first order.
    """
    into, error = wanted, wanted - comes_out(wanted)
    first_order, least = wanted + error, EXACT * np.linalg.norm(wanted)
    slope: Array | None = None
    for _ in range(MOST):
        step = error
        if not remembers:
            slope = _slope(comes_out, into) if slope is None else slope
            step = np.divide(error, slope, out=np.zeros_like(error), where=slope != 0.0)
        left = wanted - comes_out(into + step)
        if np.linalg.norm(left) > FAST * np.linalg.norm(error):
            slope = None  # the last one leads too slowly
        if remembers:
            nearer = np.full(len(wanted), np.linalg.norm(left) < SETTLING * np.linalg.norm(error))
        else:
            nearer = np.abs(left) < np.abs(error)
        into, error = np.where(nearer, into + step, into), np.where(nearer, left, error)
        if not nearer.any() or np.linalg.norm(error) <= least:
            break
    return np.where(into == wanted, first_order, into)


def _slope(comes_out: Callable[[Array], Array], signal: Array) -> Array:
    """Slope (n,) of what comes out over what goes in; 0 where hardly anything more comes out than usually does where something does."""
    width = SECANT * (float(np.std(signal)) or 1.0)
    slope = (comes_out(signal + 0.5 * width) - comes_out(signal - 0.5 * width)) / width
    passing = np.abs(slope) > NO_SLOPE
    usual = float(np.median(slope[passing])) if passing.any() else 1.0
    return np.where(passing & (slope / usual > FLAT), slope, 0.0)
