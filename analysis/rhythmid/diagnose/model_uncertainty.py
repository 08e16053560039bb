"""Dependence of a parameter's value on the explanation to which it belongs.

A fit's covariance assumes that its model is true. A small effect that the model lacks, or a rival of one that it has, moves the other
parameters by more than the noise does. By the law of total variance the covariance between models is added to that within a model.
Each model is weighted by its prediction of unseen data
(J. A. Hoeting, D. Madigan, A. E. Raftery, C. T. Volinsky, Statist. Sci. 14 (1999) 382).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.hypothesis import Hypothesis

Array = NDArray[np.float64]


def covariance_between(names: Sequence[str], chosen: Hypothesis, hypotheses: Sequence[Hypothesis]) -> Array:
    """Weighted mean product of the parameters' deviations from the chosen hypothesis, over all hypotheses that have them.

    Parameters
    ----------
    names : p parameters; the deviation of one that the chosen hypothesis does not estimate is zero.
    chosen : the hypothesis whose values are reported.
    hypotheses : all hypotheses, weighted by their predictive densities.

    Returns
    -------
    float64[p, p]
        Covariance between models, in the products of the parameters' units.
    """
    score = np.array([one.prediction.score for one in hypotheses])
    departures = np.zeros((len(hypotheses), len(names)))
    for place, name in enumerate(names):
        having = np.array([name in one.values for one in hypotheses])
        if name not in chosen.values or not having.any():
            continue
        weight = np.exp(score[having] - score[having].max())
        away = [one.values[name] - chosen.values[name] for one in hypotheses if name in one.values]
        departures[having, place] = np.sqrt(weight / weight.sum()) * np.array(away)
    return departures.T @ departures
