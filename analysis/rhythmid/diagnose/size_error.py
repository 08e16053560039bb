"""How well records determine the sizes of effects."""

import math
from collections.abc import Mapping, Sequence

from rhythmid.model import Model


def size_errors(model: Model, labels: Sequence[str], std: Mapping[str, float]) -> dict[str, float]:
    """Standard deviation of each effect's size, relative to its departure from the value at which the effect is absent.

    Parameters
    ----------
    model
        A fitted model.
    labels
        Of its effects; what is no effect, has no size that was estimated, or may be of any large size, is left out.
    std
        Standard deviations of the model's estimated parameters, by name: those of this model as it is, without what other models
        would add.
    """
    found = {}
    for label in labels:
        term = model.term(label)
        if term is None or term.element.rigid or f"{label}.{term.element.size}" not in std:
            continue
        value, absent = term.values[term.element.size].value, term.element.absent
        # where an infinite limit is no limit, its inverse is the size, and has the same relative error
        departure = abs(value) if math.isinf(absent) else abs(value - absent)
        error = std[f"{label}.{term.element.size}"]
        found[label] = error / departure if departure > 0.0 and math.isfinite(error) else math.inf
    return found
