"""What it costs a model that the elements' own states start where they like.

Every series, and in multiple shooting every window, gives a state of an element a start of its own. An element with states gains
by that alone, about one of chi2 a start, whatever its physics; over hundreds of windows that is more than what a faint effect
is worth. A fair criterion takes the average over the starts' usual range, not the best of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.free_run import FreeRun
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.sensitivity import Problem, span
from rhythmid.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FeltStart:
    """How the h states of elements of one series start.

    Parameters
    ----------
    departure : (h,) of the start from the states' usual mean, in units of their usual scatter.
    sensitivity : (n, h) of the whitened output to it, less what position and velocity at the start can do.
    """

    departure: Array
    sensitivity: Array


def felt_starts(
    model: Model,
    run: FreeRun,
    noise: NoiseModel,
    starts: Sequence[Array],
    residuals: Sequence[Array],
    state_steps: Array,
) -> list[FeltStart]:
    """The starts of each series; none where elements have no states.

    `state_steps` (2 + h,) are the differences by which sensitivities are taken.
    """
    if run.states == 2:
        return []
    problem = Problem(run, (), noise, None)
    problem.learn_hidden(model, starts)
    _, states, _, _ = problem.linearise(model, starts, residuals, np.empty(0), state_steps)
    hidden, found = run.states - 2, []
    for error, _, sensitivity in states:
        white, scatters = sensitivity[:-hidden], np.diag(sensitivity[-hidden:, 2:])
        basis = span(white[:, :2])
        felt = white[:, 2:] / scatters
        found.append(FeltStart(error[-hidden:], felt - basis @ (basis.T @ felt)))
    return found


def start_cost(starts: Sequence[FeltStart]) -> float:
    """Minus twice the logarithm of what remains of the likelihood, averaged over the starts of the elements' states.

    In Laplace's approximation (D. J. C. MacKay, Neural Computation 4 (1992) 415) d'd + ln det(I + H'H) for each series, with its
    departure d and sensitivity H. Zero without such states.
    """
    total = 0.0
    for one in starts:
        square = one.sensitivity.T @ one.sensitivity
        total += float(np.sum(one.departure**2) + np.linalg.slogdet(np.eye(len(square)) + square)[1])
    return total


def start_freedom(starts: Sequence[FeltStart]) -> float:
    """Effective number of parameters that the starts of the elements' states are: tr H'H (I + H'H)^-1 of all series.

    By as much does a log density that was reached with the starts fitted exceed, on average, what is left on other data
    (D. J. Spiegelhalter et al., J. R. Stat. Soc. B 64 (2002) 583).
    """
    total = 0.0
    for one in starts:
        square = one.sensitivity.T @ one.sensitivity
        total += float(np.trace(np.linalg.solve(np.eye(len(square)) + square, square)))
    return total
