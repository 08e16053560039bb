"""Limiting cases: an effect that does as well however small it is is but the limit that its other parameters then take.

A damper that depends on position, about a point far outside the travel, is a plain damper: the further away the point, the
smaller the coefficient. A stop that is touched once may do with a tenth of its stiffness and stays a stop, but not with a
hundredth.
"""

from dataclasses import replace

from rhythmid.compiled import compile_model
from rhythmid.diagnose.gate import faint
from rhythmid.diagnose.refit import Proposal, fainter, run_trials
from rhythmid.diagnose.search import WORTH, Search

SMALLER = 0.1, 0.01  # shares of its size, with both of which a limit does as well
# standard deviations from its absence from which a size is determined; in the bent valley towards a limit they are too small
DETERMINED = 20.0


def limiting_cases(found: Search) -> list[str]:
    """A sentence about each chosen effect of undetermined size of which nothing but a limit is determined."""
    return [
        f"{found.best.element(label).name.replace('_', ' ')} does as well with a hundredth of its size: "
        "only what it tends to then is determined, and that is something else"
        for label in found.best.added
        if faint(found, label, DETERMINED) and _only_a_limit(found, label)
    ]


def _only_a_limit(found: Search, label: str) -> bool:
    """Whether the chosen model does as well with ever smaller sizes of an effect, all else fitted again for each."""
    fit, element = found.fit, found.best.element(label)
    known = compile_model(fit.model).layout.states
    name = f"{label}.{element.size}"
    value = fit.model.parameters[name]
    model, starts = fit.model, fit.starts
    for share in SMALLER:
        less = fainter(element, {element.size: value.value}, share)[element.size]
        held = Proposal(
            found.best.added,
            model.with_parameters({name: replace(value, value=less, fixed=True)}),
            ({},),
        )
        trials, _ = run_trials([held], fit.run.series, starts, known, fit.noise, fit.run.max_step)
        if not trials or trials[0].chi2 >= fit.chi2 + WORTH:
            return False
        model, starts = trials[0].model, trials[0].starts
    return True
