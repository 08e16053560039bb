"""Directions in parameter space that are not identifiable from the records, and sums of parameters that are."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.harmonic_likelihood import INPUT_DELAY, MEASUREMENT_DELAY
from rhythmid.identify.identification import Estimate
from rhythmid.identify.natural_size import sizes_of
from rhythmid.identify.output_error import Fit
from rhythmid.value import Value

Array = NDArray[np.float64]
EXAMPLE = 0.1  # largest change of a parameter in a message, as a share of its size: small enough for a linear change


@dataclass(frozen=True)
class Direction:
    """A change of parameters (unit vector, in units of their sizes) to which the records are insensitive, in words."""

    names: tuple[str, ...]
    weights: Array
    words: str


def undetermined(fit: Fit) -> list[Direction]:
    """Directions in parameter space whose standard deviation exceeds the sizes of the parameters.

    They are the null space of the Fisher information, with each parameter scaled by its natural size: see `natural_size`.
    """
    p = len(fit.names)
    if p == 0:
        return []
    parameters = fit.model.parameters
    size = sizes_of(fit.model, fit.names, fit.run.series)
    information = (fit.linearisation.jacobian * size).T @ (fit.linearisation.jacobian * size)
    for i, name in enumerate(fit.names):
        prior = parameters[name].prior
        if prior is not None:
            information[i, i] += (size[i] / prior.std) ** 2
    values, vectors = np.linalg.eigh(information)
    floor = max(1.0, 1e-11 * float(values[-1]))  # below this the error of the finite differences dominates
    felt = np.linalg.norm(fit.linearisation.jacobian, axis=0)
    known = [parameters[name] for name in fit.names]
    return [_direction(fit.names, known, vectors[:, i], size, felt) for i in range(p) if values[i] < floor]


def _direction(
    names: Sequence[str], known: Sequence[Value], vector: Array, size: Array, felt: Array
) -> Direction:
    """The direction in words, with the parameters that take part, measured by their sizes or by the effect per unit
    in `felt`. The second is needed because the value of an undetermined parameter is arbitrary."""
    share, part = np.abs(vector) / np.abs(vector).max(), np.abs(vector * size * felt)
    large = np.flatnonzero((share > 0.05) | ((share > 1e-6) & (part > 0.05 * part.max())))
    moved = [names[int(i)] for i in large]
    step = (vector * size)[large]
    if len(moved) == 1:
        words = f"nothing in the records determines {moved[0]}"
    elif set(moved) == {INPUT_DELAY, MEASUREMENT_DELAY} and abs(step.sum()) < 0.05 * np.abs(step).max():
        words = "only the sum of the input delay and the measurement delay is identifiable"
    else:
        taking = [known[int(i)] for i in large]
        told = [
            f"{name} by {change:+.3g} {one.unit}".removesuffix(" 1")
            for name, one, change in zip(moved, taking, possible_step(taking, step, size[large]))
        ]
        words = f"these can change together without any effect on the records: {', '.join(told)}"
    return Direction(tuple(moved), vector[large], words)


def possible_step(known: Sequence[Value], step: Array, size: Array) -> Array:
    """A multiple of `step` (n,) that changes no parameter by more than `EXAMPLE` of its `size` (n,) and keeps all
    within their bounds; the first one increases if the bounds leave as much room for that as for the opposite.

    Bounds that leave no room at all are ignored: a value on its bound says that the optimum lies beyond.
    """
    example = step * (EXAMPLE / np.max(np.abs(step / size)))
    value = np.array([one.value for one in known])
    low, high = np.array([one.bounds for one in known]).T
    first = 1.0 if example[0] >= 0.0 else -1.0
    found = []
    for sign in (first, -first):
        change = sign * example
        bound = np.where(change > 0.0, high, low)
        moving = change != 0.0
        share = np.min((bound - value)[moving] / change[moving], initial=1.0)
        found.append((max(float(share), 0.0), change))
    share, change = max(found, key=lambda one: one[0])  # the first of equal ones
    return change * (share or 1.0)


def sum_of(fit: Fit, *names: str) -> Estimate:
    """Sum of parameters with its standard deviation; None where it is not identifiable."""
    value = sum(fit.model.value(name) for name in names if name in fit.model.parameters)
    places = np.array([name in names for name in fit.names], dtype=bool)
    norm = np.linalg.norm(fit.linearisation.jacobian[:, places].sum(axis=1)) if places.any() else 0.0
    own = fit.covariance[np.ix_(places, places)]
    variance = float(own.sum()) if np.isfinite(own).all() else math.inf
    # the sum of two undetermined parameters is lost in their rounding errors
    if places.sum() > 1 and not 0.0 < variance < 1.0:
        variance = 1.0 / max(_projected(fit, places) ** 2, 1e-300) if norm > 0.0 else math.inf
    std = math.sqrt(variance) if variance >= 0.0 else math.inf
    return Estimate(float(value), std if math.isfinite(std) and std < 1e6 else None, "s")


def _projected(fit: Fit, places: NDArray[np.bool_]) -> float:
    """Norm of the sensitivity to the first of the parameters `places`, with all parameters outside `places`
    projected out."""
    column = fit.linearisation.jacobian[:, np.flatnonzero(places)[0]]
    others = fit.linearisation.jacobian[:, ~places]
    if others.shape[1]:
        others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-150)
        column = column - others @ np.linalg.lstsq(others, column, rcond=1e-10)[0]
    return float(np.linalg.norm(column))


def sum_beside(fit: Fit, names: Sequence[str]) -> Estimate:
    """The sum of parameters that are not identifiable separately, in the model with all but one of them fixed."""
    places = np.array([name in names for name in fit.names])
    value = sum(fit.model.value(name) for name in names)
    return Estimate(float(value), 1.0 / max(_projected(fit, places), 1e-150), "s")
