"""Free-run error as a gate: an effect that makes the prediction of what no fit has seen worse, or no prediction better, goes.

Held-out error is a poor selector, for it hardly sees small effects; but where real machines differ from every model a
little, an information criterion goes on adding effects, and those that only imitate the rest betray themselves here.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from rhythmid.diagnose.heldout import HeldOut
from rhythmid.diagnose.search.forward import WORTH, Search
from rhythmid.diagnose.search.refit import Proposal, Trial, run_trials, whole_fit
from rhythmid.errors import InputError
from rhythmid.identify.series import Series
from rhythmid.simulation.compiled import compile_model

FAINT = 3.0  # standard deviations from its absence, nearer than which an effect's size is no size
# chi2 that an effect is worth, from which its size is only badly parted from its other parameters
NEEDED = 100.0
HARM = 0.01  # share by which the held-out error falls without an effect that does harm
USE = 0.003  # share by which the error on seen and held-out records together has to rise without an effect of use


def admitted(
    found: Search, separate: Sequence[Series] | None, pool: ThreadPoolExecutor | None = None
) -> tuple[Search, tuple[str, ...]]:
    """The search without the effects that do harm on held-out records, and a sentence about each that was dropped.

    `separate` are held-out series; None means the hidden end of the searched ones.
    """
    dropped: list[str] = []
    while found.best.added:
        least = next((label for label in found.best.added if faint(found, label)), None)
        slim = _without(found, least, pool) if least is not None else None
        if slim is not None and slim.fit.chi2 - found.fit.chi2 < NEEDED:
            found = slim
            dropped.append(f"{least}: its size is within {FAINT:g} standard deviations of its absence")
            continue
        seen, error = found.fit.nrmse(), _held_out(found, separate)
        if error is None:
            break
        cases = [(label, _without(found, label, pool)) for label in found.best.added]
        judged = [(_held_out(one, separate), label, one) for label, one in cases if one is not None]
        doubtful = [
            (other, label, one)
            for other, label, one in judged
            if other is not None
            and (
                other < (1.0 - HARM) * error
                or math.hypot(other, one.fit.nrmse()) < (1.0 + USE) * math.hypot(error, seen)
            )
        ]
        if not doubtful:
            break
        other, label, found = min(doubtful, key=lambda case: case[0])
        dropped.append(f"{label}: the held-out error is {other:.3g} without it and {error:.3g} with it")
    return found, tuple(dropped)


def faint(found: Search, label: str, limit: float = FAINT) -> bool:
    """Whether the size of an effect of the chosen model is within so many standard deviations of its absence."""
    element = found.best.element(label)
    if not element.size:
        return False
    name = f"{label}.{element.size}"
    if name not in found.fit.std:
        return False
    return abs(found.fit.model.value(name) - element.absent) < limit * found.fit.std[name]


def needed(trial: Trial) -> float:
    """Standard deviations from its absence that the criterion asks of the size of one more effect."""
    return math.sqrt(WORTH + math.log(max(trial.samples, 2)))


def _held_out(found: Search, separate: Sequence[Series] | None) -> float | None:
    return HeldOut(found, separate).nrmse(found.fit.model, found.fit)


def _without(found: Search, label: str, pool: ThreadPoolExecutor | None) -> Search | None:
    """The search with one effect of the chosen model left out and the rest refitted; None where that diverges."""
    best = found.best
    rest = tuple(name for name in best.added if name != label)
    if not rest:
        nominal = next(trial for trial in found.trials if not trial.added)
        return replace(found, best=nominal, fit=found.nominal)
    series, step = found.fit.run.series, found.fit.run.max_step
    known = compile_model(best.model).layout.states
    trials, _ = run_trials(
        [Proposal(rest, best.model.without(label), ({},))], series, best.starts, known, found.noise, step
    )
    if not trials:
        return None
    try:
        fit = whole_fit(trials[0], series, found.noise, step, pool=pool)
    except InputError:
        return None
    others = tuple(trial for trial in found.trials if set(trial.added) != set(rest))
    return replace(
        found, best=trials[0], fit=fit, trials=tuple(sorted((trials[0], *others), key=lambda t: t.bic()))
    )
