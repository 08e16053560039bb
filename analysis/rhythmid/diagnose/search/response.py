"""First-order response of a free run to a force.

Computed by the tangent linear model. For a model that keeps a history, by the difference to a run with a small part of the force,
scaled back.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.free_run import DIVERGED
from rhythmid.simulation.signal import first_order_hold

if TYPE_CHECKING:
    from rhythmid.diagnose.search.score_tests import Trajectories

Array = NDArray[np.float64]
SMALL = 1e-3  # ratio of the applied part of a force to the force that moves the machine, at most


def response(known: "Trajectories", index: int, force: Array) -> Array | None:
    """Change (n,) of the measurement of series `index` at its block centres by a force (n,); None where the model diverges."""
    tangent = known.tangents[index]
    change = _by_difference(known, index, force) if tangent is None else tangent.response(force)
    bounded = change is not None and float(np.abs(change).max()) < DIVERGED  # false for NaN, too
    return change if bounded else None


def _by_difference(known: "Trajectories", index: int, force: Array) -> Array | None:
    fit, run, path = known.fit, known.disturbed, known.paths[index]
    strength = float(np.sqrt(np.mean(force**2)))
    if strength == 0.0:
        return np.zeros(len(path.time))
    share = min(1.0, SMALL * known.push / strength)
    rows = run.rows(fit.model, index, fit.starts[index], first_order_hold(path.time, share * force))
    return None if rows is None else (rows[:, run.states] - path.signal) / share
