"""Given values: where nothing in the catalogue explains the records, one that the nominal model holds fixed may be wrong.

A mass that is given wrongly is missed like physics, but effects are like it only in part; freed, it does what several cannot.
A second mode, a mass on the mass, is like it altogether where it is fast, so that one has to do better than a freed value.
"""

from dataclasses import replace

from rhythmid.diagnose.search.forward import WORTH, Search
from rhythmid.diagnose.search.refit import Proposal, run_trials
from rhythmid.model import INERTIA, Model
from rhythmid.simulation.compiled import compile_model

BESIDE = 2  # effects at most


def wrong_value(found: Search) -> str | None:
    """A sentence about the fixed value that explains the records better when it is free, beside the first of the chosen
    effects, all but one or none, than all of them do; None where there is no such value."""
    fit, best = found.fit, found.best
    proposals: list[Proposal] = []
    first = [best.added[:count] for count in range(min(len(best.added), BESIDE) + 1)]
    but_one = [tuple(label for label in best.added if label != idle) for idle in best.added]
    for kept in dict.fromkeys((*first, *but_one)):
        model = fit.model
        for label in set(best.added) - set(kept):
            model = model.without(label)
        for name in _given(model, kept):
            freed = model.with_parameters({name: replace(model.parameters[name], fixed=False)})
            proposals.append(Proposal((*kept, name), freed, ({},)))
    known = compile_model(fit.model).layout.states
    trials, _ = run_trials(proposals, fit.run.series, fit.starts, known, found.noise, fit.run.max_step)
    if not trials or trials[0].bic() > best.bic() - (WORTH if trials[0].free >= best.free else 0.0):
        return None
    *effects, name = trials[0].added
    value, free = fit.model.parameters[name], trials[0].model.value(name)
    beside = f"with {' and '.join(effects).replace('_', ' ')} " if effects else ""
    return (
        f"{name} is held at {value.value:g} {value.unit} as given. Freed it comes out at {free:.4g}, and {beside}explains the "
        "records better than anything does while it is held: check that value, or drop its 'fixed: true'."
    )


def _given(model: Model, effects: tuple[str, ...]) -> list[str]:
    """Parameters of the nominal model that are held fixed because its author says so, not by their nature, and are not zero."""
    names = [INERTIA] if model.mass.fixed else []
    for term in model.terms:
        for key, value in term.values.items():
            if value.fixed and value.value != 0.0 and not term.element.parameter(key).fixed:
                names.append(f"{term.label}.{key}")
    return [name for name in names if name.rpartition(".")[0] not in effects]
