"""How much a parameter's value depends on which explanation it belongs to.

A fit's covariance takes its model for true. A small effect that the model lacks, or a rival of one that it has, moves the other parameters
by more than the noise does. The law of total variance adds to the variance within a model that between models, each with the
weight of what it predicts of unseen data (J. A. Hoeting, D. Madigan, A. E. Raftery, C. T. Volinsky, Statist. Sci. 14 (1999) 382).
"""

from collections.abc import Sequence

import numpy as np

from rhythmid.diagnose.hypothesis import Hypothesis


def spread_of(chosen: Hypothesis, hypotheses: Sequence[Hypothesis]) -> dict[str, float]:
    """Root mean square departure of each parameter from its value in the chosen hypothesis, over all hypotheses that have it.

    Parameters
    ----------
    chosen : the hypothesis whose values are told.
    hypotheses : all of them, weighted by their predictive densities.

    Returns
    -------
    dict[str, float]
        Spread of each parameter of `chosen`, in the parameter's unit.
    """
    made = {}
    for name, value in chosen.values.items():
        having = [one for one in hypotheses if name in one.values]
        score = np.array([one.prediction.score for one in having])
        departure = np.array([one.values[name] - value for one in having])
        weight = np.exp(score - score.max()) if len(having) else score
        made[name] = float(np.sqrt(weight @ departure**2 / weight.sum())) if len(having) else 0.0
    return made
