"""Rounding: the step of the grid that recorded values lie on.

A counter or a converter has one step. A number that is written with so many significant digits, or held in so many binary ones, has a
step that grows with its size, tenfold from one power of ten to the next or twofold from one of two [Goldberg, What every computer
scientist should know about floating-point arithmetic, ACM Computing Surveys 23 (1991)]; a scale that is applied later moves the places
where it does, and the steps are found where the values show them.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROUNDED = 0.97  # share of samples on a grid, from which a channel is rounded: some drivers mix in values of another source
LEVELS = 8  # values that occur more than once, below which they make no grid
HAIR = 1e-7  # of a signal's range, what lies nearer together than this is one value
ON_GRID = (
    0.99  # share of the steps between levels that are whole multiples, from which the levels lie on a grid
)
OFF = 0.05  # of a step, that a level on the grid may be off it
# times the range of most samples, from which the others are no part of the signal: beyond it, steps of that range come near a hair
OUTLYING_RANGES = 1e3
BAND = 64  # levels next to each other in size whose own grid is sought: too many to be multiples of one step by chance
BASES = (10.0, 2.0)  # of the digits that numbers are written with, or held in
RUNG = 0.02  # of a step, that it may be off a power of the base times another one
LADDER = 0.9  # share of bands with a grid whose steps differ by such powers; evenly read motions make grids of any step
FLOATING = 0.5  # share of samples in bands with a grid, from which it depends on their size: among those near zero few are alike


def resolution(value: Array) -> float:
    """Step of the grid that 97 % of the values (n,) at least were rounded to, in their unit; 0 where they lie on none.

    Where it depends on their size it is the coarsest.
    """
    return float(np.max(resolutions(value), initial=0.0))


def shown_resolution(value: Array) -> float:
    """The same; 0 where the values are few, which may be all that the signal has: a square wave is not rounded to its height."""
    return resolution(value) if len(np.unique(value)) >= LEVELS else 0.0


def resolutions(value: Array) -> Array:
    """Step of the grid (n,) at each of the values (n,), the coarsest near it; 0 where they lie on none."""
    bands = _bands(value)
    everywhere = _resolution(value)
    if bands is None:
        return np.full(len(value), everywhere)
    least, steps = bands
    size = np.abs(value)
    found = steps[np.maximum(np.searchsorted(least, size, side="right") - 1, 0)]
    if everywhere == 0.0 and np.mean(found > 0.0) < FLOATING:
        return np.zeros(len(value))
    return np.maximum(found, everywhere)


def _resolution(value: Array) -> float:
    """Step of the one grid that the values (n,) lie on; 0 without any."""
    levels, count = np.unique(value, return_counts=True)
    if len(levels) < 2:
        return 0.0
    step, on_grid = _grid(levels, _span(value))
    if step == 0.0 or on_grid.mean() > ON_GRID:
        return step
    common = levels[count > 1]  # a value that was not rounded hardly comes twice
    if len(common) < LEVELS:
        return 0.0
    step, on_grid = _grid(common, _span(value))
    if step == 0.0:
        return 0.0
    away = (value - common[np.argmax(count[count > 1])]) / step
    hit = np.abs(away - np.round(away)) < OFF
    return step if on_grid.mean() > ON_GRID and hit.mean() > ROUNDED else 0.0


def _span(value: Array) -> float:
    """The range of the values (n,); that of most of them where a few others are far beyond it, as where a bit fell over."""
    span = float(np.ptp(value))
    low, high = np.quantile(value, [0.5 * (1.0 - ROUNDED), 0.5 * (1.0 + ROUNDED)])
    usual = float(high - low)
    return usual if 0.0 < usual and OUTLYING_RANGES * usual < span else span


def _bands(value: Array) -> tuple[Array, Array] | None:
    """Least size (m,) of bands of levels, from small to large, and the step (m,) of their grids; None for too few levels.

    The step grows with the size, so that a band in which none shows has that of the one below; and a band that begins with finer
    levels has that of the next one.
    """
    levels = np.unique(np.abs(value))
    count = len(levels) // BAND
    if count < 2:
        return None
    span = _span(value)
    steps, least, largest = np.zeros(count), np.zeros(count), np.zeros(count)
    for k in range(count):
        band = levels[k * BAND : (k + 1) * BAND + 1]
        least[k], largest[k] = band[0], band[-1]
        step, on_grid = _grid(band, span)
        if len(on_grid) >= LEVELS and on_grid.mean() > ON_GRID:
            steps[k] = step
    steps = np.maximum.accumulate(_ladder(steps, least, largest))
    steps[:-1] = np.where(steps[:-1] > 0.0, steps[1:], 0.0)
    return least, steps


def _ladder(steps: Array, least: Array, largest: Array) -> Array:
    """Those of the steps (m,) of bands that are one of them times a power of 10 or of 2; the others 0, and all where such powers differ
    in no two of them, too many are others, or the powers do not follow the size of the levels, from `least` to `largest` (m,) in each band:
    so many digits are one step from one power of the base to the next, wherever a scale has moved these.
    """
    for base in BASES:
        seen = steps > 0.0
        if not seen.any():
            break
        power = np.log(steps[seen] / np.median(steps[seen])) / np.log(base)
        whole = np.round(power)
        on = np.abs(power - whole) * np.log(base) < RUNG
        if on.mean() < LADDER or np.ptp(whole[on]) == 0.0:
            continue
        with np.errstate(divide="ignore"):
            low, high = (np.log(size[seen][on]) / np.log(base) - whole[on] for size in (least, largest))
        if low.max() - high.min() <= 1.0:
            kept = np.zeros(len(steps))
            kept[np.flatnonzero(seen)[on]] = steps[seen][on]
            return kept
    return np.zeros(len(steps))


def _grid(levels: Array, span: float) -> tuple[float, NDArray[np.bool_]]:
    """Step of the grid that distinct levels (n,) seem to lie on, 0 without any, and which steps between them are multiples of it."""
    steps = np.diff(levels)
    steps = steps[steps > HAIR * span]  # finer ones are the representation of numbers
    if len(steps) == 0:
        return 0.0, np.empty(0, dtype=bool)
    step = float(np.median(steps[steps < 1.5 * steps.min()]))
    multiples = steps / step
    return step, np.abs(multiples - np.round(multiples)) < OFF
