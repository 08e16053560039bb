"""Dependence of a parameter's value on the explanation to which it belongs.

A fit's covariance assumes that its model is true. A small effect that the model lacks, or a rival of one that it has, moves the other
parameters by more than the noise does. By the law of total variance the covariance between models is added to that within a model.
Each model is weighted by its prediction of unseen data
(J. A. Hoeting, D. Madigan, A. E. Raftery, C. T. Volinsky, Statist. Sci. 14 (1999) 382).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.hypothesis import Hypothesis

Array = NDArray[np.float64]


def covariance_between(
    names: Sequence[str],
    chosen: Hypothesis,
    hypotheses: Sequence[Hypothesis],
    weights: Mapping[tuple[str, ...], float] | None = None,
) -> Array:
    """Weighted mean product of the parameters' deviations from the chosen hypothesis, over all hypotheses that have them.

    Parameters
    ----------
    names : p parameters; the deviation of one that the chosen hypothesis does not estimate is zero.
    chosen : the hypothesis whose values are reported.
    hypotheses : all hypotheses.
    weights : their weights, by key; by default their predictive densities.

    Returns
    -------
    float64[p, p]
        Covariance between models, in the products of the parameters' units.
    """
    score = np.array([one.prediction.score for one in hypotheses])
    if weights is not None:
        with np.errstate(divide="ignore"):
            score = np.log(np.array([weights.get(one.key, 0.0) for one in hypotheses]))
    departures = np.zeros((len(hypotheses), len(names)))
    for place, name in enumerate(names):
        having = np.array([name in one.values for one in hypotheses])
        if name not in chosen.values or not np.isfinite(score[having]).any():
            continue
        weight = np.exp(score[having] - score[having].max())
        away = [one.values[name] - chosen.values[name] for one in hypotheses if name in one.values]
        departures[having, place] = np.sqrt(weight / weight.sum()) * np.array(away)
    return departures.T @ departures


def std_among(
    std: Mapping[str, float],
    chosen: Hypothesis,
    hypotheses: Sequence[Hypothesis],
    weights: Mapping[tuple[str, ...], float],
) -> dict[str, float]:
    """Standard deviations of the chosen fit's parameters, with the differences among the hypotheses that share the evidence.

    A parameter whose value depends on which other effects the model has is not determined by the records, however small its standard
    deviation is in each fit. `weights` are those of the evidence: of hypotheses with no more effects than the chosen one.
    """
    names = list(std)
    between = np.sqrt(np.diag(covariance_between(names, chosen, hypotheses, weights)))
    return {name: float(np.hypot(std[name], more)) for name, more in zip(names, between, strict=True)}
