"""How well records determine the sizes of effects.

The error of a size tells whether an effect acts at a limit of its law. It is the error with the other effects as they are found. What two effects
have in common does not put either law in doubt: where all forces may be scaled together, as in a free decay, no size is known but the ratios are.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rhythmid.identify.covariance import covariance_of
from rhythmid.model import Model, Term
from rhythmid.value import Prior


def departure(term: Term) -> float:
    """Difference of an effect's size from the value at which the effect is absent.

    A limit is absent at infinity; the size of its effect is its inverse, with the same relative error.
    """
    value, absent = term.values[term.element.size].value, term.element.absent
    return abs(value) if math.isinf(absent) else abs(value - absent)


def size_errors(model: Model, labels: Sequence[str], std: Mapping[str, float]) -> dict[str, float]:
    """Standard deviation of each effect's size, relative to its difference from the value at which the effect is absent.

    Parameters
    ----------
    model
        A fitted model.
    labels
        Labels of its effects. Labels of other things, and effects whose size is not estimated or may be arbitrarily large, are
        left out.
    std
        Standard deviations of the effects' estimated parameters, by name, without contributions from other models; see
        `std_beside_others`.
    """
    found = {}
    for label in labels:
        term = model.term(label)
        if term is None or term.element.rigid or f"{label}.{term.element.size}" not in std:
            continue
        size, error = departure(term), std[f"{label}.{term.element.size}"]
        found[label] = error / size if size > 0.0 and math.isfinite(error) else math.inf
    return found


def std_beside_others(
    labels: Sequence[str],
    std: Mapping[str, float],
    jacobian: NDArray[np.float64],
    priors: Sequence[Prior | None],
) -> dict[str, float]:
    """Standard deviation of each effect's parameters where the parameters of the other effects are known.

    Parameters
    ----------
    labels
        Labels of the effects.
    std
        Standard deviations of all p estimated parameters, by name. What has widened them remains.
    jacobian, priors
        Sensitivities (n, p) of the residual to these parameters, in units of its noise, and their priors.

    Returns
    -------
    dict
        By the parameter's name; other parameters are left out.
    """
    names, effects = list(std), [name.rpartition(".")[0] for name in std]
    together = np.diag(covariance_of(jacobian, priors))
    found = {}
    for label in labels:
        kept = [place for place, effect in enumerate(effects) if effect == label or effect not in labels]
        beside = np.diag(covariance_of(jacobian[:, kept], [priors[place] for place in kept]))
        for place, variance in zip(kept, beside, strict=True):
            if effects[place] == label:
                told = 0.0 < together[place] < math.inf  # else the records do not determine it
                ratio = math.sqrt(min(variance / together[place], 1.0)) if told else 1.0
                found[names[place]] = std[names[place]] * ratio
    return found
