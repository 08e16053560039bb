"""How well records determine the sizes of effects."""

import math
from collections.abc import Mapping, Sequence

from rhythmid.model import Model, Term


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
        Standard deviations of the model's estimated parameters, by name, without contributions from other models.
    """
    found = {}
    for label in labels:
        term = model.term(label)
        if term is None or term.element.rigid or f"{label}.{term.element.size}" not in std:
            continue
        size, error = departure(term), std[f"{label}.{term.element.size}"]
        found[label] = error / size if size > 0.0 and math.isfinite(error) else math.inf
    return found
