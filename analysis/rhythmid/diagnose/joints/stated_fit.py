"""The fit of a joint's path with the effects that its answer states, and no others."""

from collections.abc import Sequence
from dataclasses import replace

from rhythmid.diagnose.effort.fitted import Fitted
from rhythmid.diagnose.effort.run import EffortResult


def stated_fit(result: EffortResult, stated: Sequence[str]) -> Fitted:
    """The nominal path's fit where nothing is stated, else the one with these labels.

    The chosen hypothesis may hold effects of too low a probability to be stated. Then the fit of the search with the stated ones alone is taken,
    whose values do not lean on those effects; where the search has none, the chosen one without them.
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
