"""The tangent linear model of a free run: response to small changes of state and force over each interval between two rows.

It is the derivative of the numerical solution, by finite differences over one interval each, so that they stay small in a large
motion (F. Rabier, P. Courtier, Q. J. R. Meteorol. Soc. 118 (1992) 649, linearise along a trajectory in the same way).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.free_run import NO_SIGNAL, FreeRun
from rhythmid.identify.inputs import Pieces
from rhythmid.model import Model
from rhythmid.simulation.kernel_source import tangent_module
from rhythmid.simulation.machine_code import load_run
from rhythmid.simulation.signal import FAR

Array = NDArray[np.float64]
# difference step, as a share of the scatter of a state or of the given force: with a rounding error of 1e-16 of the result, and its
# curvature, the derivative is accurate to five digits
DIFFERENCE = 1e-5


@dataclass(frozen=True)
class Tangent:
    """The linear maps of all intervals between n rows, for q states.

    `maps` (n - 1, q + 1, q + 2) map the changes of the state (q) and of the force at both ends of an interval (2) to those of
    the next state (q) and output (1). `direct` is the change of the first output per unit of force.
    """

    maps: Array
    direct: float

    def response(self, force: Array) -> Array:
        """Change (n,) of the output by a small force (n,), linear between its values."""
        found = np.empty(len(force))
        load_run(tangent_module())(self.maps, self.direct, np.ascontiguousarray(force), found)
        return found


def tangent(run: FreeRun, model: Model, index: int, states: Array, force: float) -> Tangent | None:
    """The tangent linear model along a run of series `index`, in which disturbances act.

    Parameters
    ----------
    states : (n, q) at the block centres, as the run has them.
    force : typical size of a force on the mass.

    Returns None for a model that keeps a history, and where a difference diverges.
    """
    given = run.prepared(model, index)
    if given.compiled.layout.history:
        return None
    times, q = given.times, states.shape[1]
    scatter = states.std(axis=0)
    moved = DIFFERENCE * np.where(scatter > 0.0, scatter, np.maximum(np.abs(states).max(axis=0), 1e-12))
    pushed = DIFFERENCE * force
    command, forcing = _Stretches(given.command, times), _Stretches(given.forcing, times)
    maps, ends = np.empty((len(times) - 1, q + 1, q + 2)), np.empty((2, q + 2))
    direct = 0.0

    def end(begun: Sequence[Array], start: Array, disturbance: Pieces) -> Array:
        given.compiled.run(*begun, *disturbance, given.parameters, start, run.max_step, ends)
        return ends[1, : q + 1]

    for k in range(len(times) - 1):
        start, begun = states[k].copy(), (times[k : k + 2], *command.at(k), *forcing.at(k))
        base, first = end(begun, start, NO_SIGNAL).copy(), ends[0, q]
        for i in range(q):
            start[i] = states[k, i] + moved[i]
            maps[k, :, i] = (end(begun, start, NO_SIGNAL) - base) / moved[i]
            start[i] = states[k, i]
        for i, values in enumerate(((pushed, 0.0), (0.0, pushed))):
            maps[k, :, q + i] = (
                end(begun, start, _straight(times[k], times[k + 1], *values)) - base
            ) / pushed
            if k == i == 0:
                direct = (ends[0, q] - first) / pushed
    return Tangent(maps, direct) if np.isfinite(maps).all() else None


class _Stretches:
    """The pieces of a signal in each interval between times (n,)."""

    def __init__(self, signal: Pieces, times: Array) -> None:
        self.knots, self.coefficients = signal
        self.first = np.searchsorted(self.knots, times, side="right") - 1

    def at(self, k: int) -> Pieces:
        first, last = self.first[k], self.first[k + 1]
        part = np.ascontiguousarray(self.coefficients[:, first : last + 1])
        return self.knots[first : last + 2], part


def _straight(begin: float, end: float, first: float, last: float) -> Pieces:
    """A force that is linear between two values at two times, and constant outside."""
    coefficients = np.zeros((4, 3))
    coefficients[0] = first, first, last
    coefficients[1, 1] = (last - first) / (end - begin)
    return np.array([-FAR, begin, end, FAR]), coefficients
