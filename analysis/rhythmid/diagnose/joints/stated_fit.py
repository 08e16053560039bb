"""The fit of a joint's path with the effects that its answer states, and no others."""

import math
from collections.abc import Sequence
from dataclasses import replace

from rhythmid.diagnose.answer.compose_effort import effort_parameters
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.run import EffortResult


def stated_fit(result: EffortResult, stated: Sequence[str]) -> Fitted:
    """The nominal path's fit if nothing is stated, else the fit with these labels.

    The chosen hypothesis may contain effects whose probability is too low to be stated. Then the search's fit with the stated effects alone is
    used, because its values do not depend on the others. If the search has none, the others are removed from the chosen fit.
    """
    if not stated:
        return result.nominal
    chosen, known = result.chosen, result.nominal.fit.model
    further = {
        label
        for label in chosen.elements
        if label not in stated and chosen.fit.model.term(label) is not None and known.term(label) is None
    }
    if not further:
        return chosen
    for one in result.search.hypotheses:
        if set(one.elements) == set(stated):
            return one
    model = chosen.fit.model
    kept = replace(model, terms=tuple(term for term in model.terms if term.label not in further))
    return replace(chosen, fit=replace(chosen.fit, model=kept))


def stated_parameters(result: EffortResult, stated: Sequence[str]) -> dict[str, Estimate]:
    """Values at a joint, by name: those of the fit with the stated labels, beside which no other effect holds a part of their size; of effects that
    are not stated, those of the chosen hypothesis.

    The standard deviations of the chosen hypothesis hold more than those of its fit: the choice of the model and small effects that
    it lacks. Those of the stated values hold the same.
    """
    found = effort_parameters(result.chosen)
    if not stated:
        return found
    fitted = stated_fit(result, stated)
    told = effort_parameters(fitted)
    if set(fitted.elements) != set(result.chosen.elements):
        beyond = _beyond_the_fit(result)
        told = {name: _wider(one, beyond.get(name, 0.0)) for name, one in told.items()}
    return {**found, **told}


def _beyond_the_fit(result: EffortResult) -> dict[str, float]:
    """What the standard deviations of the chosen hypothesis hold beyond those of its fit, by parameter."""
    of_fit: dict[str, float] = {}
    for one in result.search.hypotheses:
        if set(one.elements) == set(result.chosen.elements):
            of_fit = one.std()
    whole = result.chosen.std()
    return {
        name: math.sqrt(max(std**2 - of_fit[name] ** 2, 0.0)) for name, std in whole.items() if name in of_fit
    }


def _wider(found: Estimate, std: float) -> Estimate:
    """The estimate with a further standard deviation; one that is fixed or not determined is as it was."""
    return replace(found, std=math.hypot(found.std, std)) if found.std else found
