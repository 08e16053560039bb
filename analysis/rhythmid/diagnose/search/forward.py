"""Forward search for missing elements, then pruning: the model that explains the records with the fewest effects.

Each round scores the whole catalogue (cheap), refits the most promising elements with everything free (dear), and keeps
the best if it is worth its parameters. Afterwards backward elimination tries every element: against being left out, against
a simpler member of its family, and, where there are several, against the other candidates.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.diagnose.case import SPENT, Budget
from rhythmid.diagnose.constants import FOLLOWS, PRACTICAL
from rhythmid.diagnose.search.backward import eliminate
from rhythmid.diagnose.search.order import in_best_order
from rhythmid.diagnose.search.refit import (
    fine_enough,
    near_under_noise,
    reach_of,
    run_trials,
    under_noise,
    whole_fit,
)
from rhythmid.diagnose.search.round import Round, distinct, not_tried, one_round
from rhythmid.diagnose.search.score_tests import (
    changes_of,
    guesses,
    p_value,
    score,
    sizes_along,
    trajectories,
    under,
)
from rhythmid.diagnose.search.trial import Proposal, Trial, propose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.errors import InputError
from rhythmid.identify.free_run import accurate
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise, noise_of
from rhythmid.identify.sample_clock.clock import has_clock
from rhythmid.identify.sample_clock.tick_likelihood import ticks_sought
from rhythmid.identify.series import Series
from rhythmid.identify.start_cost import felt_starts, start_cost
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.progress import Tell

Array = NDArray[np.float64]

# difference of the information criterion below which two models are indistinguishable
WORTH = 10.0
SHARE = 5e-4  # of what is explained already, below which a further effect is an imperfection of the others
LEVEL = 0.01  # false-alarm rate of a round's score tests, over the whole catalogue
# elements of a round that are refitted because they score best along the whole records, and in windows. On 90 cases of all
# machines of the proof the right one, or its kin, was among the first four or among the first three in windows
REFITTED, LOCAL = 4, 3
# difference of the criterion within which models are compared again under the noise that they leave
NEAR = 60.0
# gain in the criterion from which a model is worth a second look where a better one does not hold under the noise that it
# leaves; and how many of them get it
PLAIN, SECOND = 100.0, 2
UNDERSTATED = 0.1  # share of what a refit gains that a score shows at least, where an effect is far from its first guess
EFFECTS_AT_ONCE = 3  # effects at once
RIVALS_COMPARED = 4  # models of each number of effects that are compared at the end
OVERTAKEN = 4  # rankings at the end, each under the noise that the leader of the one before leaves
MANY = 5  # guesses of one element beyond which its shape matters so much that more of them are tried
# of the noise: integration error of an element with corners beyond which all steps are made finer
POOR_FIT = 0.1


@dataclass(frozen=True)
class Search:
    """What the search found.

    `nominal` is the refitted nominal model, `best` the chosen one (the nominal one when nothing is missing) and `fit` its
    full fit, all under the same `noise`. `trials` are all models that were refitted, by information criterion;
    `excluded` those that could not be simulated, with the reason. `cut_short` says whether the budget ended the search before all
    effects that scored well were tried.
    """

    nominal: Fit
    best: Trial
    fit: Fit
    noise: NoiseModel
    trials: tuple[Trial, ...]
    rounds: tuple[Round, ...]
    excluded: tuple[tuple[tuple[str, ...], str], ...]
    cut_short: bool = False


def _proposals(base: Model, now: Round, count: int, chi2: float) -> tuple[list[Proposal], list[float]]:
    """Structures worth a refit, with chi2 below which one start of each is enough: the elements that score best along the whole
    records, and those that do in windows."""
    made, enough = [], []
    local = {best.element.name: group for best, group in distinct(now.local, LOCAL)}
    for best, group in distinct(now.scores, count):
        starts = [(one.start, one.own(base)) for one in group[: 3 if len(group) > MANY else 2]]
        if not 0.2 < abs(best.size) < 5.0:  # far from the guess that was scored, the size is an extrapolation
            starts.insert(1, (dict(best.values), best.own(base, 1.0)))
        starts = [*[(one.start, {}) for one in local.pop(best.element.name, [])[:1]], *starts][:3]
        values, beside = zip(*starts)
        made.append(propose(base, best.element, values, now.added, chi2, beside))
        enough.append(chi2 - 0.8 * best.statistic)
    for group in local.values():
        made.append(propose(base, group[0].element, [one.start for one in group[:2]], now.added, chi2))
        enough.append(-math.inf)
    return made, enough


def _from_given(
    nominal: Fit, given: Model, catalogue: Catalogue, chi2: float, pool: ThreadPoolExecutor | None
) -> list[Proposal]:
    """Structures worth a refit from the values that the nominal model was given with.

    Where it loses the machine all the same, its refit has bent them to stand in for what is missing: the spring of a hopper
    that leaves the ground comes out far too soft and too long.
    """
    values = {name: given.value(name) for name in nominal.names if name in given.parameters}
    model = nominal.model.with_values(values)
    try:
        fit = minimise(model, nominal.run, nominal.names, nominal.noise, nominal.starts, 0, pool)
        known = trajectories(fit)
    except InputError:
        return []
    scores = score(fit, changes_of(known, guesses(catalogue, model, sizes_along(known)), pool))
    return _proposals(model, Round(tuple(scores), p_value(scores)), REFITTED, chi2)[0]


def _better_of(trials: Sequence[Trial]) -> list[Trial]:
    """The better one of each two trials of the same structure, best first."""
    kept: dict[tuple[str, ...], Trial] = {}
    for trial in sorted(trials, key=lambda t: t.bic()):
        kept.setdefault(trial.added, trial)
    return list(kept.values())


def search(
    series: Sequence[Series],
    nominal: Fit,
    given: Model,
    catalogue: Catalogue,
    pool: ThreadPoolExecutor | None,
    tell: Tell = lambda _: None,
    budget: Budget | None = None,
    most: int = EFFECTS_AT_ONCE,
) -> Search:
    """Search the catalogue for what the nominal model lacks; `nominal` is the fit to the same series of the one `given`.

    At most `most` effects are found. Once the `budget` is spent no further round begins; what was not tried is told among the excluded.
    """
    budget = budget or Budget()
    step = nominal.run.max_step
    floor = 1e-9 * max(float(np.std(one.averaged)) for one in series)
    tell("scoring the catalogue")
    first, nominal = one_round(nominal, (), catalogue, pool)
    current, noise = nominal, nominal.noise
    base = Trial(
        (),
        nominal.model,
        nominal.starts,
        nominal.chi2,
        nominal.samples,
        len(nominal.names),
        nominal.converged,
        noise,
        nominal.differences,
        start_cost(
            felt_starts(
                nominal.model, nominal.run, noise, nominal.starts, nominal.residuals, nominal.differences[1]
            )
        ),
    )
    trials: dict[tuple[str, ...], Trial] = {(): base}
    # the same model under the noise that it leaves, and under a round's, out of which the catalogue's guesses are taken
    best = here = base
    rounds, excluded = [first], not_tried(nominal, catalogue, first)
    now = first
    gained, cut_short = 0.0, False
    while (
        now.chance < LEVEL
        and _could_pay(now, best, max(WORTH, SHARE * gained), current)
        and len(best.added) < most
    ):
        if budget.spent:
            excluded += [((score.element.name,), SPENT) for score, _ in distinct(now.scores, REFITTED)]
            cut_short = True
            break
        count = REFITTED if not best.added else REFITTED - 1
        proposals, enough = _proposals(here.model, replace(now, added=here.added), count, here.chi2)
        tell(f"refitting with {', '.join(p.added[-1] for p in proposals)}")
        begun = series, here.starts, current.run.compiled.layout.states, here.noise, step
        found, failed = run_trials(proposals, *begun, enough, tell=tell)
        if not best.added and nominal.nrmse() > FOLLOWS:
            proposals = _from_given(nominal, given, catalogue, here.chi2, pool)
            others, failed_too = run_trials(proposals, *begun, tell=tell)
            found, failed = _better_of([*found, *others]), failed + failed_too
        excluded += failed
        found = [t for t in found if t.chi2 < here.chi2]  # a richer model that does worse got lost
        if not found:
            break
        trials |= {tuple(sorted(t.added)): t for t in found}
        near = [t for t in found if t.bic() - found[0].bic() < NEAR]
        margin = max(WORTH, SHARE * gained)
        hopeful = [[t] for t in found[len(near) :] if here.bic() - t.bic() > PLAIN][:SECOND]
        for group in (near, *hopeful):
            top = _most_likely(group, series, here.noise, step, floor)
            fit = whole_fit(top, series, here.noise, step, pool=pool)
            finer = accurate(fit.run, fit.model, fit.starts, POOR_FIT * fit.noise.variance**0.5, 2)
            if finer.max_step < 0.45 * fine_enough(top.model, step):
                step = finer.max_step
                fit = whole_fit(replace(top, converged=False), series, here.noise, step, pool=pool)
            sought = top
            if any(
                has_clock(top.model, label) for label in top.added[-2:]
            ):  # and once more beside what came after it
                fit = ticks_sought(fit, floor, pool)
                sought = replace(top, model=fit.model, starts=fit.starts, converged=False)
            others = [trial for trial in group if trial.added != top.added]
            settled = noise_of(fit.residuals, series, floor)
            reach = reach_of(fit.chi2, fit.samples)
            compared = under_noise([sought, *others, best], series, settled, step, reach=reach)
            trials |= {tuple(sorted(t.added)): t for t in compared}
            winner = compared[0]
            before = next((t for t in compared if t.added == best.added), best)
            gain = before.bic() - winner.bic()
            if winner.added != best.added and gain >= margin:
                break
        else:  # what the noise model of the round saw in them, the noise that they leave does not bear out
            break
        noise = settled
        best = in_best_order(winner, series, noise, step)
        gained += gain + winner.chi2 - best.chi2
        trials[tuple(sorted(best.added))] = best
        tell(f"{best.added[-1]} explains it better by {gain:.0f}; looking for more")
        current = whole_fit(best, series, noise, step, pool=pool)
        if len(best.added) >= most:
            break
        now, current = one_round(current, best.added, catalogue, pool)
        here = under_noise([best], series, current.noise, step, 0)[0]
        rounds.append(now)
    if best.added and budget.spent:
        excluded.append((("backward elimination",), SPENT))
    elif best.added:
        margin = max(WORTH, SHARE * gained)
        reduced, more = eliminate(best, series, catalogue, trials, noise, step, rounds, margin, tell)
        trials |= more
        if reduced is not best:
            best = in_best_order(reduced, series, noise, step)
            trials[tuple(sorted(best.added))] = best
            noise = noise_of(whole_fit(best, series, noise, step, pool=pool).residuals, series, floor)
    ranked = _contenders(trials, best)
    for _ in range(OVERTAKEN):
        ranked = near_under_noise(ranked, series, noise, step, NEAR)
        best = next(t for t in ranked if set(t.added) == set(best.added))
        ahead = max(WORTH, SHARE * gained) if ranked[0].free > best.free else WORTH
        if ranked[0].bic() >= best.bic() - ahead or not ranked[0].added:
            break
        best = ranked[0]  # a model set aside under an earlier noise model has overtaken the chosen one
        noise = noise_of(whole_fit(best, series, noise, step, pool=pool).residuals, series, floor)
    else:
        ranked = near_under_noise(ranked, series, noise, step, NEAR)
        best = next(t for t in ranked if set(t.added) == set(best.added))
    fit = whole_fit(best, series, noise, step, pool=pool)
    return Search(
        under(nominal, noise, pool),
        best,
        fit,
        noise,
        tuple(ranked),
        tuple(rounds),
        tuple(excluded),
        cut_short,
    )


def _most_likely(
    near: Sequence[Trial], series: Sequence[Series], noise: NoiseModel, step: float, floor: float
) -> Trial:
    """The one of several close models whose remainder predicts itself best: each under the noise that it leaves.

    The first noise model is coloured by the effect that is missing and can put a surrogate ahead by a little.
    """
    if len(near) == 1:
        return near[0]

    def left(trial: Trial) -> float:
        return noise_of(whole_fit(trial, series, noise, step).residuals, series, floor).std

    found = {index: std for index, std in fork_map(left, near) if not isinstance(std, Exception)}
    return near[min(found, key=lambda index: (found[index], index), default=0)]


def _could_pay(now: Round, best: Trial, margin: float, current: Fit) -> bool:
    """Whether the best score, which can understate what a refit gains, is of the order that an element has to earn, and that an
    effect of practical size has."""
    series, noise = current.run.series, current.noise
    if current.nrmse() ** 2 < UNDERSTATED * PRACTICAL**2:
        return False
    power = sum(one.power(one.used) for one in series)  # the number of samples times the motion's mean square
    practical = PRACTICAL**2 * power / max(noise.variance, noise.long_run_variance)
    return now.strongest > max(0.5 * (margin + math.log(max(best.samples, 2))), UNDERSTATED * practical)


def _contenders(trials: dict[tuple[str, ...], Trial], best: Trial) -> list[Trial]:
    """The models worth comparing at the end: the nominal one, the best of each number of effects, and the chosen one with all
    that it is without some of its effects: what each of them brings is judged against these."""
    ranked = sorted(trials.values(), key=lambda t: t.bic())
    kept = {tuple(sorted(t.added)): t for t in [trials[()], best]}
    for count in {len(t.added) for t in ranked if t.added}:
        same = [t for t in ranked if len(t.added) == count][:RIVALS_COMPARED]
        kept = {tuple(sorted(t.added)): t for t in same} | kept
    parts = {key: t for key, t in trials.items() if set(key) < set(best.added)}
    return list((parts | kept).values())
