"""Backward elimination: test whether each chosen effect can be left out or replaced by another one."""

from collections.abc import Callable, Mapping, Sequence

from rhythmid.diagnose.search.refit import run_trials, under_noise
from rhythmid.diagnose.search.round import Round, distinct
from rhythmid.diagnose.search.trial import Origin, Proposal, Trial, propose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.progress import Tell

# number of elements that scored best at first, and of those that fit best alone, that are tried in place of each of several effects
RIVALS_TRIED = 2


def eliminate(
    best: Trial,
    series: Sequence[Series],
    catalogue: Catalogue,
    trials: Mapping[tuple[str, ...], Trial],
    noise: NoiseModel,
    step: float,
    rounds: Sequence[Round],
    margin: float,
    reach: float,
    tell: Tell,
) -> tuple[Trial, dict[tuple[str, ...], Trial]]:
    """Backward elimination of the added elements; returns the remaining model and all models tried.

    First test whether an effect can be left out. Then test replacements: a simpler member of its family or, where there are several
    effects, an element that scored well before the others were known or that fits well alone. A replacement may make other effects
    needless. A simpler model is preferred if its criterion is worse by less than `margin`. `reach` is the chi2 that a model needs to
    compete with the `best`.
    """
    tried: dict[tuple[str, ...], Trial] = {}
    begun = best.chi2

    def run(known: Trial, proposals: list[Proposal]) -> list[Trial]:
        fresh = [p for p in proposals if p.key not in tried]
        if not fresh:
            return []
        tell(f"testing {', '.join(' + '.join(p.added) for p in fresh)}")
        within = reach + known.chi2 - begun + margin
        found, _ = run_trials(fresh, series, Origin.of(known), noise, step, reach=within, tell=tell)
        tried.update({t.key: t for t in found})
        return found

    best = _without_idle(best, run, margin)
    single = [trial for trial in trials.values() if len(trial.added) == 1]
    alone = _alone(under_noise(single, series, noise, step, 0)) if len(best.added) > 1 else {}
    found = run(best, _swaps(best, series, catalogue, trials, alone, rounds))
    earlier = [t for t in trials.values() if t.added and _stands_for(t, best)]
    plainer = [t for t in [*found, *under_noise(earlier, series, noise, step)] if _stands_for(t, best)]
    simpler = [t for t in plainer if t.bic() < best.bic() + margin]
    better = [t for t in found if t.bic() < best.bic()]
    if better:
        best = _without_idle(min(better, key=lambda t: t.bic()), run, margin)
    elif simpler:
        best = min(simpler, key=lambda t: (t.free, t.bic()))
    return best, tried


def _without_idle(best: Trial, run: Callable[[Trial, list[Proposal]], list[Trial]], margin: float) -> Trial:
    """The model without the effects that can be left out."""
    while len(best.added) > 1:
        slim = [best.without(label) for label in best.added]
        dropped = run(best, [Proposal(one.added, one.model) for one in slim if one.added])
        kept = [t for t in dropped if t.bic() < best.bic() + margin]
        if not kept:
            break
        best = min(kept, key=lambda t: t.bic())
    return best


def _swaps(
    best: Trial,
    series: Sequence[Series],
    catalogue: Catalogue,
    trials: Mapping[tuple[str, ...], Trial],
    alone: Mapping[str, Trial],
    rounds: Sequence[Round],
) -> list[Proposal]:
    """Models with one of the effects replaced by another element."""
    swaps: list[Proposal] = []
    scored = {score.element.name for score, _ in distinct(rounds[0].scores, RIVALS_TRIED)}
    for label in best.added:
        element = best.element(label)
        family = {e.name for e in catalogue.values() if element.name in e.special_case_of and e.candidate}
        names = set(family)
        if len(best.added) > 1:
            names |= scored | set(list(alone)[:RIVALS_TRIED])
        slim = best.without(label)
        for name in sorted(names - {best.element(other).name for other in best.added}):
            starts = _starts_for(catalogue, name, series, slim.model, rounds, 8 if name in family else 1)
            beside: list[dict[str, float]] = []
            if starts and name in family:  # start a special case at the values of the law that contains it
                own = {parameter.name for parameter in catalogue[name].parameters}
                values = _values(best, label).items()
                starts.insert(0, starts[0] | {key: value for key, value in values if key in own})
            elif tuple(sorted((*slim.added, name))) in trials:
                continue
            elif name in alone:
                # the fit with this effect alone also gives the other parameters: a spring, for example, contains a pendulum's gravity
                starts, beside = [_values(alone[name], name), *starts], [_given(alone[name], slim.model)]
            if starts:
                swaps.append(propose(slim.model, catalogue[name], starts, slim.added, beside=beside))
    return swaps


def _alone(single: Sequence[Trial]) -> dict[str, Trial]:
    """The models with one effect, by its name, best first; from models sorted by fit under one noise model."""
    named = [(trial.element(trial.added[0]).name, trial) for trial in single]
    return {name: trial for name, trial in named if name == trial.added[0]}


def _values(trial: Trial, label: str) -> dict[str, float]:
    """Parameter values of the element with a label."""
    return {p.name: trial.model.value(f"{label}.{p.name}") for p in trial.element(label).parameters}


def _given(trial: Trial, model: Model) -> dict[str, float]:
    """A trial's values of the parameters that are free in another model, too."""
    return {name: trial.model.value(name) for name in model.free if name in trial.model.parameters}


def _stands_for(trial: Trial, best: Trial) -> bool:
    """Whether a model is simpler than the best: a subset of its effects, or a special case in place of one of them."""
    if trial.free >= best.free:
        return False
    if set(trial.added) < set(best.added):
        return True
    extra = [trial.element(label) for label in trial.added if label not in best.added]
    gone = [best.element(label) for label in best.added if label not in trial.added]
    return len(extra) == len(gone) == 1 and gone[0].name in extra[0].special_case_of


def _starts_for(
    catalogue: Catalogue,
    name: str,
    series: Sequence[Series],
    model: Model,
    rounds: Sequence[Round],
    count: int,
) -> list[dict[str, float]]:
    """First guesses of an element for a refit: those with the best scores in any round, else the element's own."""
    scored = sorted(
        (s for r in rounds for s in r.scores if s.element.name == name and s.statistic > 0.0),
        key=lambda s: -s.statistic,
    )
    if scored:
        return [one.start for one in scored[:count]]
    element = catalogue[name]
    return [dict(s) for s in element.first_guesses(scales(series, model))][:count] if element.starts else []
