"""Search over the whole range for the initial memory states of each series (of backlash, of a rate limit).

The sensitivity to a start outside the backlash gap, or at the input, is zero, so a descent cannot leave it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.sensitivity import Problem, state_update
from rhythmid.model import Model

Array = NDArray[np.float64]
SHARES = np.linspace(-1.0, 1.0, 13)  # shares of the usual range


def sought(
    problem: Problem,
    model: Model,
    starts: Sequence[Array],
    states: Sequence[tuple[Array, Array, Array]],
    state_steps: Array,
) -> list[Array]:
    """For each series the best start among its own and those with other memory states; the other states are solved
    for again.

    `states` are the series' whitened residuals and sensitivities, as `Problem.linearise` returns them.
    """
    best, lowest = list(starts), [np.inf] * len(starts)
    memories = list(problem.run.compiled.layout.memories)
    frozen = [sensitivity.copy() for _, _, sensitivity in states]
    for one in frozen:
        one[:, memories] = 0.0
    for place in memories:
        cases = [list(best)]
        for share in SHARES:
            cases.append([start.copy() for start in best])
            for start, (mean, scatter) in zip(cases[-1], problem.hidden):
                start[place] = mean[place - 2] + share * scatter[place - 2]
        for tried, outputs in zip(cases, problem.run.many([(model, case) for case in cases], problem.pool)):
            for index, (start, sensitivity) in enumerate(zip(tried, frozen)):
                if outputs is None:
                    continue
                left = outputs[index] - problem.run.series[index].averaged
                error = np.concatenate([problem.whitened(index, left), problem.departure(index, start)])
                change = state_update(sensitivity, error)
                cost = float(np.sum((error + sensitivity @ change) ** 2))
                if cost < lowest[index]:
                    best[index], lowest[index] = start + change * state_steps, cost
    return best
