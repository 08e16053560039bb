"""Cost of free initial values of the elements' own states in the comparison of models.

In every series, and in multiple shooting in every window, the initial state of an element is fitted. An element
with states gains about one of chi2 per initial state by that alone, whatever its law. Over hundreds of windows that
exceeds the gain of a small effect. A fair criterion averages the likelihood over the usual range of the starts
instead of taking its maximum.
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
    """Initial values of the h element states of one series.

    Parameters
    ----------
    departure : (h,) deviation of the start from the states' usual mean, in units of their usual scatter.
    sensitivity : (n, h) of the whitened output to it, with the effects of initial position and velocity projected out.
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
    """The starts of each series; empty where elements have no states.

    `state_steps` (2 + h,) are the finite-difference steps for the sensitivities.
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
    """Minus twice the logarithm of the ratio of the likelihood averaged over the element states' starts to its maximum.

    In Laplace's approximation (D. J. C. MacKay, Neural Computation 4 (1992) 415) d'd + ln det(I + H'H) for each series, with its
    departure d and sensitivity H. Zero without such states.
    """
    total = 0.0
    for one in starts:
        square = one.sensitivity.T @ one.sensitivity
        total += float(np.sum(one.departure**2) + np.linalg.slogdet(np.eye(len(square)) + square)[1])
    return total


def start_freedom(starts: Sequence[FeltStart]) -> float:
    """Effective number of parameters of the element states' starts: tr H'H (I + H'H)^-1 over all series.

    On average, the log density with fitted starts exceeds that on other data by this number (D. J. Spiegelhalter et
    al., J. R. Stat. Soc. B 64 (2002) 583).
    """
    total = 0.0
    for one in starts:
        square = one.sensitivity.T @ one.sensitivity
        total += float(np.trace(np.linalg.solve(np.eye(len(square)) + square, square)))
    return total
