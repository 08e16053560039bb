"""Inversion along a trajectory: the input, at every instant, that gives a wanted output."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST_INVERSION_STEPS = 12  # most iterations: an error that halves each time is then below a thousandth
# largest share of the error that so many corrections may leave where an element remembers: a rate limit, which cannot be inverted, leaves
# nearly all of it, a lag of a time constant that is six times as long as the shortest period over 2 pi a tenth
SETTLING, FIRST = 0.5, 4
# share of the error after a step below which the previous slopes are reused: new ones cost two evaluations
FAST = 0.1
EXACT = 1e-6  # relative accuracy of an inversion
CLOSE = 1e-2  # that of the difference of two inversions, for a derivative
# smallest share of a step that is tried: enough for a slope that grows fivefold along the step
LEAST_SHARE = 0.2
SECANT = 1e-3  # step of the finite difference for a slope, relative to the signal
FLAT = 0.05  # share of its usual slope below which an element counts as blocking its input
NO_SLOPE = 1e-9  # slope below which it is rounding error of the output, with a step of `SECANT`


@dataclass(frozen=True, eq=False)
class Inverted:
    """The input `into` (n,), and the `error` (n,) of its output. `slope` (n,) is the derivative of the output with
    respect to the input; None where it was not requested, or where the output does not depend on the same instant
    alone."""

    into: Array
    error: Array
    slope: Array | None = None


def inverted(
    comes_out: Callable[[Array], Array], wanted: Array, remembers: bool, with_slope: bool = False
) -> Inverted:
    """Input (n,) whose output is `wanted` (n,).

    Where the output depends on the same instant alone, Newton steps are taken at each instant; where the element `remembers`, those of
    `_of_past`. In a dead band or beyond a limit, where the output does not respond, the result is the input to first order.
    """
    into, error = wanted, wanted - comes_out(wanted)
    first_order, least = wanted + error, EXACT * np.linalg.norm(wanted)
    if remembers:
        found = _of_past(comes_out, wanted, into, error, float(least))
        return Inverted(first_order, wanted - comes_out(first_order)) if found is None else found
    slope: Array | None = None
    share = np.ones(len(wanted))  # share of a step, halved where the step overshoots because the slope grows
    for _ in range(MOST_INVERSION_STEPS):
        slope = _slope(comes_out, into) if slope is None else slope
        reached = slope != 0.0  # whether the wanted output is reachable
        step = share * np.divide(error, slope, out=np.zeros_like(error), where=reached)
        left = wanted - comes_out(into + step)
        if np.linalg.norm(left[reached]) > FAST * np.linalg.norm(error[reached]):
            slope = None  # the last slope converges too slowly
        nearer = np.abs(left) < np.abs(error)
        into, error = np.where(nearer, into + step, into), np.where(nearer, left, error)
        share = np.where(nearer, 1.0, 0.5 * share)
        stands = not nearer.any() and share.max() < LEAST_SHARE
        if stands or np.linalg.norm(error[reached]) <= least:
            break
    last = _slope(comes_out, into) if with_slope else None
    return Inverted(np.where(into == wanted, first_order, into), error, last)


def _of_past(
    comes_out: Callable[[Array], Array], wanted: Array, into: Array, error: Array, least: float
) -> Inverted | None:
    """Input (n,) for `wanted` (n,) from a first `into` (n,) with its `error` (n,); None where the output does not follow the input.

    The errors of all inputs that were tried are combined to the smallest one, and the input of the combination is corrected by it (D. G. Anderson,
    J. ACM 12 (1965) 547). To subtract only the last error would hardly change what is fast beside a lag.
    """
    inputs, errors, whole = [into], [error], float(np.linalg.norm(error))
    for count in range(1, MOST_INVERSION_STEPS + 1):
        if float(np.linalg.norm(error)) <= least:
            break
        if count > FIRST and float(np.linalg.norm(error)) > SETTLING * whole:
            return None
        inputs.append(into + error)
        errors.append(wanted - comes_out(inputs[-1]))
        apart = np.column_stack([one - errors[0] for one in errors[1:]])
        shares = np.linalg.lstsq(apart, -errors[0], rcond=EXACT)[0]
        into = inputs[0] + np.column_stack([one - inputs[0] for one in inputs[1:]]) @ shares
        error = errors[0] + apart @ shares
    error = wanted - comes_out(into)
    return Inverted(into, error) if float(np.linalg.norm(error)) <= SETTLING * whole else None


def followed(
    known: Inverted, comes_out: Callable[[Array], Array], wanted: Array, remembers: bool
) -> Inverted:
    """Input (n,) for `wanted` (n,) where both differ little from those of a `known` inversion: to first order, with
    one evaluation of the output. A full inversion is made where the output does not respond somewhere, or where the
    slope is unknown. Where the element `remembers`, the small difference is inverted."""
    if remembers:
        target, error = wanted - known.error, wanted - known.error - comes_out(known.into)
        least = CLOSE * float(np.linalg.norm(error))
        return _of_past(comes_out, target, known.into, error, least) or inverted(comes_out, wanted, remembers)
    if known.slope is None or not known.slope.all():
        return inverted(comes_out, wanted, remembers)
    step = (wanted - comes_out(known.into) - known.error) / known.slope
    return Inverted(known.into + step, known.error)


@dataclass(frozen=True, eq=False)
class Inversions:
    """The inversions from the forces of one motion to its effort. `made` holds them by the label of the inverted
    element ("" for the forces that depend on the effort as load); `known` holds those of a model with nearly the
    same values, used as first-order starts."""

    known: Mapping[str, Inverted] = field(default_factory=dict)
    made: dict[str, Inverted] = field(default_factory=dict)
    with_slopes: bool = False

    def inverted(
        self, label: str, comes_out: Callable[[Array], Array], wanted: Array, remembers: bool
    ) -> Array:
        """Input (n,) whose output is `wanted` (n,)."""
        if label in self.known:
            found = followed(self.known[label], comes_out, wanted, remembers)
        else:
            found = inverted(comes_out, wanted, remembers, self.with_slopes)
        self.made[label] = found
        return found.into


def _slope(comes_out: Callable[[Array], Array], signal: Array) -> Array:
    """Slope (n,) of output over input; 0 where the output responds far less than usual."""
    width = SECANT * (float(np.std(signal)) or 1.0)
    slope = (comes_out(signal + 0.5 * width) - comes_out(signal - 0.5 * width)) / width
    passing = np.abs(slope) > NO_SLOPE
    usual = float(np.median(slope[passing])) if passing.any() else 1.0
    return np.where(passing & (slope / usual > FLAT), slope, 0.0)
