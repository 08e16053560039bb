"""Rounding: the quantisation step of recorded values.

A counter or a converter has one step. A number with a fixed number of significant digits, decimal or binary, has a
step that grows with its size: tenfold from one power of ten to the next, or twofold from one power of two to the
next [Goldberg, What every computer scientist should know about floating-point arithmetic, ACM Computing Surveys 23
(1991)]. A scale that is applied later moves these limits. So the steps are determined from the values themselves.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# share of samples on a grid above which a channel is rounded: some drivers mix in values of another source
ROUNDED = 0.97
LEVELS = 8  # least number of values that occur more than once
HAIR = 1e-7  # share of a signal's range below which two values are equal
ON_GRID = 0.99  # share of steps between levels that are whole multiples, above which the levels lie on a grid
OFF = 0.05  # deviation of a level from the grid, in steps
# ratio to the range of most samples above which the others are not part of the signal: above it, steps of that
# range approach HAIR
OUTLYING_RANGES = 1e3
BAND = 64  # neighbouring levels whose own grid is determined: too many to be multiples of one step by chance
BASES = (10.0, 2.0)  # of decimal and of binary numbers
RUNG = 0.02  # relative deviation of a step from another one times a power of the base
# share of bands with a grid whose steps differ by such powers; evenly sampled motions can form grids of any step
LADDER = 0.9
# share of the steps between levels that may be narrower than the rounding step: values of another source
NARROW = 1.0 - ROUNDED
# share of samples in bands with a grid above which the step depends on the size: few values near zero are equal
FLOATING = 0.5


def resolution(value: Array) -> float:
    """Rounding step of at least 97 % of the values (n,), in their unit; 0 where they are not rounded.

    Where it depends on their size, the coarsest step.
    """
    return float(np.max(resolutions(value), initial=0.0))


def shown_resolution(value: Array) -> float:
    """The same; 0 where there are few distinct values, which may be all levels of the signal: a square wave is not
    rounded to its height."""
    return resolution(value) if len(np.unique(value)) >= LEVELS else 0.0


def least_step(value: Array) -> float:
    """Step between neighbouring levels of the values (n,) that nearly all such steps reach; 0 for few levels.

    It is the rounding step also where no grid is detected, as for an encoder's angle that was written with too few
    decimals. Where values are not rounded, it is a small part of their usual distance, and so of no effect.
    """
    levels = np.unique(value)
    steps = np.diff(levels)
    steps = steps[steps > HAIR * _span(value)]
    return float(np.quantile(steps, NARROW)) if len(levels) >= LEVELS and len(steps) else 0.0


def resolutions(value: Array) -> Array:
    """Rounding step (n,) at each of the values (n,), the coarsest nearby; 0 where they are not rounded."""
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
    """Step of the one grid on which the values (n,) lie; 0 without any."""
    levels, count = np.unique(value, return_counts=True)
    if len(levels) < 2:
        return 0.0
    step, on_grid = _grid(levels, _span(value))
    if step == 0.0 or on_grid.mean() > ON_GRID:
        return step
    common = levels[count > 1]  # an unrounded value seldom occurs twice
    if len(common) < LEVELS:
        return 0.0
    step, on_grid = _grid(common, _span(value))
    if step == 0.0:
        return 0.0
    away = (value - common[np.argmax(count[count > 1])]) / step
    hit = np.abs(away - np.round(away)) < OFF
    return step if on_grid.mean() > ON_GRID and hit.mean() > ROUNDED else 0.0


def _span(value: Array) -> float:
    """Range of the values (n,), or of most of them where a few others are far outside, for example because of a
    flipped bit."""
    span = float(np.ptp(value))
    low, high = np.quantile(value, [0.5 * (1.0 - ROUNDED), 0.5 * (1.0 + ROUNDED)])
    usual = float(high - low)
    return usual if 0.0 < usual and OUTLYING_RANGES * usual < span else span


def _bands(value: Array) -> tuple[Array, Array] | None:
    """Least size (m,) of bands of levels, in increasing order, and the step (m,) of their grids; None for too few levels.

    The step grows with the size. So a band without a detected step has that of the band below, and a band that
    starts with finer levels has that of the next one.
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
    """Those of the steps (m,) of bands that are equal up to powers of 10 or of 2; the others are 0.

    All are 0 in three cases: no two steps differ by such a power, too many steps are others, or the powers do not
    follow the size of the levels, from `least` to `largest` (m,) in each band. With a fixed number of digits the
    step is constant from one power of the base to the next, wherever a scale has moved these powers.
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
    """Step of the grid of distinct levels (n,), 0 without any, and a mask of the steps between levels that are
    multiples of it."""
    steps = np.diff(levels)
    steps = steps[steps > HAIR * span]  # finer steps are due to the number format
    if len(steps) == 0:
        return 0.0, np.empty(0, dtype=bool)
    step = float(np.median(steps[steps < 1.5 * steps.min()]))
    multiples = steps / step
    return step, np.abs(multiples - np.round(multiples)) < OFF
