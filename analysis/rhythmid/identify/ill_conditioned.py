"""Ill-conditioned directions in parameter space, with sensitivities differenced along these directions.

Parameters with similar effects (gravity and rest length) cancel in the sum of their columns. What remains of
one-sided differences is then their error. If the parameters are moved together, with a central difference, they
cancel in the simulation itself. What remains then is the true sensitivity of the outputs.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.sensitivity import Linearisation, Problem
from rhythmid.model import Model

Array = NDArray[np.float64]
# singular value of the scaled sensitivities, relative to the largest, below which a direction is treated
ILL_CONDITIONED = 1e-3


def ill_conditioned(jacobian: Array) -> list[Array]:
    """Directions (p,): changes of the parameters that would change the outputs by one if they did not cancel. Empty
    where the sensitivities (n, p) are well conditioned."""
    norms = np.linalg.norm(jacobian, axis=0)
    live = norms > 0.0
    if live.sum() < 2:
        return []
    _, singular, right = np.linalg.svd(jacobian[:, live] / norms[live], full_matrices=False)
    found = []
    for value, direction in zip(singular, right):
        if value < ILL_CONDITIONED * singular[0]:
            change = np.zeros(len(norms))
            change[live] = direction / norms[live]
            found.append(change)
    return found


def with_ill_conditioned_directions(
    linearisation: Linearisation, problem: Problem, model: Model, starts: Sequence[Array]
) -> Linearisation:
    """The linearisation with its sensitivities along ill-conditioned directions replaced by central differences
    along them."""
    jacobian = linearisation.jacobian
    norms = np.linalg.norm(jacobian, axis=0)
    size = (
        float(np.median((norms * np.abs(linearisation.steps))[norms > 0.0])) if np.any(norms > 0.0) else 0.0
    )
    for change in ill_conditioned(jacobian):
        slope = _slope(linearisation, problem, model, starts, change, size)
        if slope is not None:
            # dual vector: its product with `change` is one, with the other directions zero
            dual = change * norms**2
            jacobian = jacobian + np.outer(slope - jacobian @ change, dual)
    return replace(linearisation, jacobian=jacobian)


def _slope(
    linearisation: Linearisation,
    problem: Problem,
    model: Model,
    starts: Sequence[Array],
    change: Array,
    size: float,
) -> Array | None:
    """Whitened slope of the outputs along `change`, initial states projected out; None where a simulation diverges or the
    bounds leave no room."""
    values = np.array([model.value(name) for name in problem.names])
    bounds = np.array([model.parameters[name].bounds for name in problem.names])
    room = np.minimum(values - bounds[:, 0], bounds[:, 1] - values)
    moving = change != 0.0
    step = float(min(size, np.min(0.5 * room[moving] / np.abs(change[moving]))))
    if not step > 0.0:
        return None
    ends = []
    for sign in (1.0, -1.0):
        moved = model.with_values(dict(zip(problem.names, values + sign * step * change)))
        outputs = problem.run.outputs(moved, starts)
        if outputs is None:
            return None
        ends.append(outputs)
    pieces = []
    for index, (after, before) in enumerate(zip(*ends)):
        white = problem.whitened(index, (after - before) / (2.0 * step))
        basis = linearisation.bases[index]
        pieces.append(white - basis @ (basis.T @ white))
    return np.concatenate(pieces)
