"""Covariance of a fit, and the parameters that it cannot tell from their bounds."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.model import Model

Array = NDArray[np.float64]
PART = 1e-5  # of an undetermined direction's largest component, below which a parameter takes no part in it
EDGE = 1e-3  # standard deviations from its bound, nearer than which a parameter is taken to be there


def covariance_of(jacobian: Array, priors: Sequence) -> Array:
    """Inverse of the Fisher information; infinite variances in directions that the records do not determine."""
    p = jacobian.shape[1]
    if p == 0:
        return np.zeros((0, 0))
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1e-150
    scaled = jacobian / norms
    information = scaled.T @ scaled
    for i, prior in enumerate(priors):
        if prior is not None:
            information[i, i] += 1.0 / (prior.std * norms[i]) ** 2
    eigenvalues, vectors = np.linalg.eigh(information)
    known = eigenvalues > 1e-11 * max(eigenvalues[-1], 1e-300)
    inverse = np.where(known, 1.0 / np.maximum(eigenvalues, 1e-300), 1e24)
    # rounding gives every parameter a trace of an undetermined direction; only those that take part are undetermined
    vectors = np.where(~known & (np.abs(vectors) < PART * np.abs(vectors).max(axis=0)), 0.0, vectors)
    with np.errstate(over="ignore"):
        return (vectors * inverse) @ vectors.T / np.outer(norms, norms)


def on_the_edge(model: Model, names: Sequence[str], covariance: Array) -> dict[str, float]:
    """Bounds of the parameters that are very close to one for their uncertainty, but not on it."""
    found: dict[str, float] = {}
    for name, variance in zip(names, np.diag(covariance)):
        value = model.value(name)
        for bound in model.parameters[name].bounds:
            if math.isfinite(bound) and 0.0 < abs(value - bound) < EDGE * math.sqrt(
                max(float(variance), 0.0)
            ):
                found[name] = bound
    return found
