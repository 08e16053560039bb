"""Limiting cases: an effect that does as well with a tenth of its size is but the limit that its other parameters then take.

A damper that depends on position, about a point far outside the travel, is a plain damper: the further away the point, the
smaller the coefficient. A stop that is touched once stays a stop, however uncertain its stiffness.
"""

from dataclasses import replace

from rhythmid.compiled import compile_model
from rhythmid.diagnose.gate import faint
from rhythmid.diagnose.refit import Proposal, fainter, run_trials
from rhythmid.diagnose.search import WORTH, Search

TENTH = 0.1
# standard deviations from its absence from which a size is determined; in the bent valley towards a limit they are too small
DETERMINED = 20.0


def limiting_cases(found: Search) -> list[str]:
    """A sentence about each chosen effect of undetermined size of which nothing but a limit is determined."""
    best, fit = found.best, found.fit
    known = compile_model(fit.model).layout.states
    said: list[str] = []
    for label in best.added:
        if not faint(found, label, DETERMINED):
            continue
        element = best.element(label)
        name = f"{label}.{element.size}"
        value = fit.model.parameters[name]
        less = fainter(element, {element.size: value.value}, TENTH)[element.size]
        model = fit.model.with_parameters({name: replace(value, value=less, fixed=True)})
        trials, _ = run_trials(
            [Proposal(best.added, model, ({},))],
            fit.run.series,
            fit.starts,
            known,
            fit.noise,
            fit.run.max_step,
        )
        if trials and trials[0].chi2 < fit.chi2 + WORTH:
            said.append(
                f"{element.name.replace('_', ' ')} does as well with a tenth of its size: "
                "only what it tends to then is determined, and that is something else"
            )
    return said
