"""Covariance of a fit, and the parameters whose estimates are too close to a bound to be distinguished from it."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.model import Model

Array = NDArray[np.float64]
# a parameter's own share of its sensitivity, not reproduced by the others: below this it is rounding of the finite
# differences
OWN = 1e-5
# distance from a bound, in standard deviations, within which a parameter counts as being at the bound
EDGE = 1e-3


def covariance_of(jacobian: Array, priors: Sequence) -> Array:
    """Inverse of the Fisher information; infinite variances in directions that the records do not determine.

    A parameter that the records do not determine at all has the variance of its prior.
    """
    p = jacobian.shape[1]
    if p == 0:
        return np.zeros((0, 0))
    precise = np.array([0.0 if one is None else 1.0 / one.std for one in priors])
    rows = np.vstack([jacobian, np.diag(precise)])
    norms = np.linalg.norm(rows, axis=0)
    norms[norms == 0.0] = 1e-150
    rows = rows / norms
    information = rows.T @ rows
    eigenvalues, vectors = np.linalg.eigh(information)
    known = eigenvalues > 1e-11 * max(eigenvalues[-1], 1e-300)
    inverse = np.where(known, 1.0 / np.maximum(eigenvalues, 1e-300), 1e24)
    # rounding gives every parameter a component in an undetermined direction; it counts only for parameters whose
    # effect the others can reproduce
    if not known.all():
        vectors = np.where(~known & (_own_part(rows) > OWN)[:, None], 0.0, vectors)
    with np.errstate(over="ignore"):
        return (vectors * inverse) @ vectors.T / np.outer(norms, norms)


def _own_part(rows: Array) -> Array:
    """Share (p,) of each unit-norm column of rows (n, p) that the other columns cannot reproduce."""
    triangle = np.linalg.qr(rows).R
    found = []
    for i in range(rows.shape[1]):
        one, others = triangle[:, i], np.delete(triangle, i, axis=1)
        made = others @ np.linalg.lstsq(others, one, rcond=1e-12)[0] if others.size else 0.0
        found.append(float(np.linalg.norm(one - made)))
    return np.array(found)


def on_the_edge(model: Model, names: Sequence[str], covariance: Array) -> dict[str, float]:
    """Bounds of the parameters that lie within a small part of their standard deviation from a bound, but not on it."""
    found: dict[str, float] = {}
    for name, variance in zip(names, np.diag(covariance)):
        value = model.value(name)
        for bound in model.parameters[name].bounds:
            if math.isfinite(bound) and 0.0 < abs(value - bound) < EDGE * math.sqrt(
                max(float(variance), 0.0)
            ):
                found[name] = bound
    return found
