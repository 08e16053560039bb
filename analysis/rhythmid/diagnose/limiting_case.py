"""Limiting cases: an effect that does as well however small it is is but the limit that its other parameters then take.

A damper that depends on position, about a point far outside the travel, is a plain damper: the further away the point, the
smaller the coefficient. A stop that is touched once may do with a tenth of its stiffness and stays a stop, but not with a
hundredth. Beside other effects the limit may also be what these take over: of two lags in one path only the sum.
"""

from dataclasses import replace

from rhythmid.diagnose.gate import faint, needed
from rhythmid.diagnose.search.forward import WORTH, Search
from rhythmid.diagnose.search.refit import Proposal, fainter, run_trials
from rhythmid.simulation.compiled import compile_model

SMALLER = 0.1, 0.01  # shares of its size, with both of which a limit does as well
# standard deviations from its absence from which a size is determined; in the bent valley towards a limit they are too small
DETERMINED = 20.0


def limiting_cases(found: Search) -> list[str]:
    """A sentence about each chosen effect of undetermined size of which nothing but a limit is determined.

    Beside others an effect has to be worth what the criterion asks of one more, for it was chosen for what they do together;
    a descent that does not come to its end shows nothing there, and what the curvature says holds.
    """
    labels = found.best.added
    asked = needed(found.best) if len(labels) > 1 else 0.0
    return [
        _sentence(found, label)
        for label in labels
        if faint(found, label, DETERMINED)
        and _only_a_limit(found, label, max(WORTH, asked**2), faint(found, label, asked))
    ]


def _sentence(found: Search, label: str) -> str:
    words = {one: found.best.element(one).name.replace("_", " ") for one in found.best.added}
    if len(words) > 1:
        return f"only what {' and '.join(words.values())} do together is determined, not the size of {words[label]}"
    return (
        f"{words[label]} does as well with a hundredth of its size: "
        "only what it tends to then is determined, and that is something else"
    )


def _only_a_limit(found: Search, label: str, margin: float, unless_shown: bool) -> bool:
    """Whether ever smaller sizes of an effect cost the chosen model less than `margin` of chi2, all else fitted again for
    each; `unless_shown` where a descent did not come to its end."""
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
        if not trials:
            return False
        if trials[0].chi2 >= fit.chi2 + margin:
            return unless_shown and not trials[0].converged
        model, starts = trials[0].model, trials[0].starts
    return True
