"""What a force does to a free run, to first order: the difference to a run with a small part of it, scaled back.

A machine that swings freely keeps every change of its phase, and the more cycles it goes through the smaller a force has to be for the
answer to be in proportion to it.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rhythmid.simulation.signal import first_order_hold

if TYPE_CHECKING:
    from rhythmid.diagnose.search.score_tests import Trajectories

Array = NDArray[np.float64]
SMALL = 1e-3  # of the force that shakes the machine: a force that is tried is no larger at first
# of the motion's size: a change of phase by so much leaves its square, 1e-4, to what is not in proportion
PROPORTIONAL = 1e-2
ATTEMPTS = 4  # with smaller parts: each one is a hundredth of that before at least, where the answer is far from proportion
FEWEST_PARTS = 1e-2  # of a part that was tried, the next one at least


def response(known: "Trajectories", index: int, force: Array) -> Array | None:
    """Change (n,) of what series `index` measures at its block centres that a force (n,) along its path makes; None where the model diverges."""
    fit, run, path = known.fit, known.disturbed, known.paths[index]
    strength = float(np.sqrt(np.mean(force**2)))
    if strength == 0.0:
        return np.zeros(len(path.time))
    share = min(1.0, SMALL * fit.model.mass.value * known.shaken / strength)
    most = PROPORTIONAL * float(np.std(known.outputs[index]))
    change = None
    for _ in range(ATTEMPTS):
        rows = run.rows(fit.model, index, fit.starts[index], first_order_hold(path.time, share * force))
        if rows is None:
            return None
        difference = rows[:, run.states] - known.outputs[index]
        change = difference / share
        size = float(np.sqrt(np.mean(difference**2)))
        if size <= most or most == 0.0:
            break
        share *= max(0.5 * most / size, FEWEST_PARTS)
    return change
