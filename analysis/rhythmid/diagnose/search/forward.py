"""Forward search for missing elements, then pruning: the model that explains the records with the fewest effects.

Each round scores the whole catalogue (cheap), refits the most promising elements with everything free (dear), and keeps
the best if it is worth its parameters. Afterwards backward elimination tries every element: against being left out, against
a simpler member of its family, and, where there are several, against the other candidates.
"""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, deadline, time_is_up
from rhythmid.diagnose.case import SEARCHED, Budget
from rhythmid.diagnose.constants import FOLLOWS, PRACTICAL
from rhythmid.diagnose.search.backward import eliminate
from rhythmid.diagnose.search.order import in_best_order
from rhythmid.diagnose.search.proposals import REFITTED, WORTH, better_of, from_given, proposals, refitted
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
    under,
)
from rhythmid.diagnose.search.trial import Origin, Trial
from rhythmid.elements.catalogue import Catalogue
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

SHARE = 5e-4  # of what is explained already, below which a further effect is an imperfection of the others
LEVEL = 0.01  # false-alarm rate of a round's score tests, over the whole catalogue
GROUPS = 3  # of so many elements that are refitted for the first effect, one after the other, while none does better
# difference of the criterion within which models are compared again under the noise that they leave, and the same as a share of what
# the best of them gains: a noise model that is coloured by what is missing puts a surrogate ahead by so much (Silverbox: a ripple before the
# cubic spring by 0.15 % of the gain)
NEAR, NEAR_SHARE = 60.0, 0.01
# gain in the criterion from which a model is worth a second look where a better one does not hold under the noise that it
# leaves; and how many of them get it
PLAIN, SECOND = 100.0, 2
UNDERSTATED = 0.1  # share of what a refit gains that a score shows at least, where an effect is far from its first guess
EFFECTS_AT_ONCE = 3  # effects at once
RIVALS_COMPARED = 4  # models of each number of effects that are compared at the end
OVERTAKEN = 4  # rankings at the end, each under the noise that the leader of the one before leaves


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


@dataclass(frozen=True)
class _Task:
    """What all rounds of a search need; `floor` is the least standard deviation of a noise, `step` [s] the nominal model's."""

    series: Sequence[Series]
    nominal: Fit
    given: Model
    catalogue: Catalogue
    pool: ThreadPoolExecutor | None
    tell: Tell
    floor: float

    @property
    def step(self) -> float:
        """Largest integration step [s] of any model."""
        return self.nominal.run.max_step

    def noise_left(self, trial: Trial, noise: NoiseModel) -> NoiseModel:
        """The noise that a model leaves which is fitted under another one."""
        fit = whole_fit(trial, self.series, noise, self.step, pool=self.pool)
        return noise_of(fit.residuals, self.series, self.floor)


@dataclass(frozen=True)
class _State:
    """Where a search stands.

    `best` is the chosen model under the `noise` that it leaves, `here` the same under the noise of the last round, out of which the
    catalogue's guesses are taken, and `current` its fit there. `gained` is what all effects together have improved the criterion by.
    """

    best: Trial
    here: Trial
    current: Fit
    noise: NoiseModel
    trials: Mapping[tuple[str, ...], Trial]
    rounds: tuple[Round, ...]
    excluded: tuple[tuple[tuple[str, ...], str], ...]
    gained: float = 0.0

    @property
    def margin(self) -> float:
        """What a further effect has to improve the criterion by."""
        return max(WORTH, SHARE * self.gained)

    def with_trials(self, trials: Sequence[Trial]) -> "_State":
        """The state that knows these trials, too."""
        return replace(self, trials={**self.trials, **{tuple(sorted(one.added)): one for one in trials}})

    def without(self, tried: Sequence[tuple[tuple[str, ...], str]]) -> "_State":
        """The state that knows, too, what was not tried, or could not be simulated."""
        return replace(self, excluded=(*self.excluded, *tried))


@dataclass(frozen=True)
class _Grant:
    """A model that explains the records better, by so much of the criterion, and the noise that it leaves."""

    winner: Trial
    gain: float
    noise: NoiseModel


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

    At most `most` effects are found. Once the `budget` is spent no further round begins, and fits that are under way end with what they
    have; what was not tried is told among the excluded.
    """
    budget = budget or Budget()
    with deadline(budget.at(SEARCHED)):
        return _searched(series, nominal, given, catalogue, pool, tell, budget, most)


def _searched(
    series: Sequence[Series], nominal: Fit, given: Model, catalogue: Catalogue, pool: ThreadPoolExecutor | None, tell: Tell,
    budget: Budget, most: int,
) -> Search:  # fmt: skip
    tell("scoring the catalogue")
    first, nominal = one_round(nominal, (), catalogue, pool)
    floor = 1e-9 * max(float(np.std(one.averaged)) for one in series)
    task = _Task(series, nominal, given, catalogue, pool, tell, floor)
    state, ended = _begun(task, first), False
    while len(state.best.added) < most and _could_pay(state):
        if budget.spent:
            state, ended = state.without(_cut_off(state)), True
            break
        state, found = _refitted(task, state)
        state, grant = _granted(task, state, found)
        if grant is None:
            break
        state = _with_effect(task, state, grant, last=len(grant.winner.added) >= most)
    cut_short = ended or any(why == SPENT for _, why in state.excluded)
    if state.best.added and budget.spent:
        state = state.without([(("backward elimination",), SPENT)])
    elif state.best.added:
        state = _reduced(task, state)
        state = state.without([(("part of the backward elimination",), SPENT)] if time_is_up() else [])
    best, noise, ranked = _ranked(task, state)
    fit = whole_fit(best, series, noise, task.step, pool=pool)
    return Search(
        under(nominal, noise, pool), best, fit, noise, tuple(ranked), state.rounds, state.excluded, cut_short
    )


def _begun(task: _Task, first: Round) -> _State:
    """The state before any effect, the first round scored."""
    fit = task.nominal
    felt = felt_starts(fit.model, fit.run, fit.noise, fit.starts, fit.residuals, fit.differences[1])
    base = Trial(
        (), fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), fit.converged, fit.noise, fit.differences,
        start_cost(felt),
    )  # fmt: skip
    lost = not_tried(fit, task.catalogue, first)
    return _State(base, base, fit, fit.noise, {(): base}, (first,), tuple(lost))


def _cut_off(state: _State) -> list[tuple[tuple[str, ...], str]]:
    """What is not tried any more once the budget is spent: the elements that scored best, or all that may stand beside the effects
    that were found last, after which nothing was scored."""
    added, last = state.best.added, state.rounds[-1]
    if last.added != added:
        return [((f"further effects beside {' and '.join(added)}",), SPENT)]
    return [((one.element.name,), SPENT) for one, _ in distinct(last.scores, REFITTED)]


def _refitted(task: _Task, state: _State) -> tuple[_State, list[Trial]]:
    """Refits of the models that the last round proposes, those that do better than the best so far, best first."""
    here, now = state.here, replace(state.rounds[-1], added=state.here.added)
    count = refitted(now, REFITTED if not state.best.added else REFITTED - 1)
    begun = task.series, Origin.of(here), here.noise, task.step
    found, failed = [], []
    # where nothing is found yet and none of the best does better, they were kin that the scores, which are linear, promise too much of
    for first in range(0, count * (1 if state.best.added else GROUPS), count):
        proposed, enough = proposals(here.model, now, count, here.chi2, first)
        if any(one.chi2 < here.chi2 for one in found) or not proposed:
            break
        task.tell(f"refitting with {', '.join(p.added[-1] for p in proposed)}")
        others, lost = run_trials(proposed, *begun, enough, tell=task.tell)
        found, failed = better_of([*found, *others]), failed + lost
    if not state.best.added and task.nominal.nrmse() > FOLLOWS:
        proposed = from_given(task.nominal, task.given, task.catalogue, here.chi2, task.pool)
        others, lost = run_trials(proposed, *begun, tell=task.tell)
        found, failed = better_of([*found, *others]), failed + lost
    found = [one for one in found if one.chi2 < here.chi2]  # a richer model that does worse got lost
    return state.without(failed).with_trials(found), found


def _granted(task: _Task, state: _State, found: Sequence[Trial]) -> tuple[_State, _Grant | None]:
    """The refit that explains the records best, where it is worth its parameters under the noise that it leaves."""
    if not found:
        return state, None
    best, here = state.best, state.here
    within = max(NEAR, NEAR_SHARE * (here.bic() - found[0].bic()))
    near = [one for one in found if one.bic() - found[0].bic() < within]
    hopeful = [[one] for one in found[len(near) :] if here.bic() - one.bic() > PLAIN][:SECOND]
    for group in (near, *hopeful):
        top = _most_likely(group, task.series, here.noise, task.step, task.floor)
        fit = _finely_fitted(task, top, here.noise)
        sought = top
        # a clock is sought once more beside what came after it
        if any(has_clock(top.model, label) for label in top.added[-2:]):
            fit = ticks_sought(fit, task.floor, task.pool)
            sought = replace(top, model=fit.model, starts=fit.starts, converged=False)
        others = [trial for trial in group if trial.added != top.added]
        settled = noise_of(fit.residuals, task.series, task.floor)
        reach = reach_of(fit.chi2, fit.samples)
        compared = under_noise([sought, *others, best], task.series, settled, task.step, reach=reach)
        state = state.with_trials(compared)
        winner = compared[0]
        before = next((one for one in compared if one.added == best.added), best)
        gain = before.bic() - winner.bic()
        if winner.added != best.added and gain >= state.margin:
            return state, _Grant(winner, gain, settled)
    # what the noise model of the round saw in them, the noise that they leave does not bear out
    return state, None


def _finely_fitted(task: _Task, trial: Trial, noise: NoiseModel) -> Fit:
    """The whole fit of a trial, in steps that are fine enough for what it leaves: what was an error of integration beside a mismatch may
    be all that is left once that is explained."""
    fit = whole_fit(trial, task.series, noise, task.step, pool=task.pool)
    if time_is_up():
        return fit
    left = noise_of(fit.residuals, task.series, task.floor)
    run = fine_enough(fit.run, fit.model, fit.starts, left.variance**0.5)
    if run is fit.run:
        return fit
    return minimise(fit.model, run, fit.names, noise, fit.starts, pool=task.pool, differences=fit.differences)


def _with_effect(task: _Task, state: _State, grant: _Grant, last: bool) -> _State:
    """The state with one effect more, the next round scored where it is not the last one."""
    best = in_best_order(grant.winner, task.series, grant.noise, task.step)
    gained = state.gained + grant.gain + grant.winner.chi2 - best.chi2
    task.tell(f"{best.added[-1]} explains it better by {grant.gain:.0f}; looking for more")
    current = whole_fit(best, task.series, grant.noise, task.step, pool=task.pool)
    state = replace(state.with_trials([best]), best=best, current=current, noise=grant.noise, gained=gained)
    if last or time_is_up():
        return state
    now, current = one_round(current, best.added, task.catalogue, task.pool)
    here = under_noise([best], task.series, current.noise, task.step, 0)[0]
    return replace(state, here=here, current=current, rounds=(*state.rounds, now))


def _reduced(task: _Task, state: _State) -> _State:
    """The state after backward elimination."""
    best, noise = state.best, state.noise
    reduced, more = eliminate(
        best, task.series, task.catalogue, state.trials, noise, task.step, state.rounds, state.margin, task.tell
    )  # fmt: skip
    state = state.with_trials(list(more.values()))
    if reduced is best:
        return state
    best = in_best_order(reduced, task.series, noise, task.step)
    return replace(state.with_trials([best]), best=best, noise=task.noise_left(best, noise))


def _ranked(task: _Task, state: _State) -> tuple[Trial, NoiseModel, list[Trial]]:
    """The best model once all are compared under the noise that it leaves, that noise, and the models, best first."""
    best, noise, step = state.best, state.noise, task.step
    ranked = _contenders(state.trials, best)
    for _ in range(OVERTAKEN):
        ranked = near_under_noise(ranked, task.series, noise, step, NEAR)
        best = next(one for one in ranked if set(one.added) == set(best.added))
        ahead = state.margin if ranked[0].free > best.free else WORTH
        if ranked[0].bic() >= best.bic() - ahead or not ranked[0].added:
            return best, noise, ranked
        best = ranked[0]  # a model set aside under an earlier noise model has overtaken the chosen one
        noise = task.noise_left(best, noise)
    ranked = near_under_noise(ranked, task.series, noise, step, NEAR)
    return next(one for one in ranked if set(one.added) == set(best.added)), noise, ranked


def _most_likely(
    near: Sequence[Trial], series: Sequence[Series], noise: NoiseModel, step: float, floor: float
) -> Trial:
    """The one of several close models whose remainder predicts itself best: each under the noise that it leaves.

    The first noise model is coloured by the effect that is missing and can put a surrogate ahead by a little.
    """
    if len(near) == 1 or time_is_up():
        return near[0]

    def left(trial: Trial) -> float:
        return noise_of(whole_fit(trial, series, noise, step).residuals, series, floor).std

    found = {index: std for index, std in fork_map(left, near) if not isinstance(std, Exception)}
    return near[min(found, key=lambda index: (found[index], index), default=0)]


def _could_pay(state: _State) -> bool:
    """Whether the best score of the last round, which can understate what a refit gains, is more than chance, of the order that an
    element has to earn, and that an effect of practical size has."""
    now, series, noise = state.rounds[-1], state.current.run.series, state.current.noise
    if now.chance >= LEVEL or state.current.nrmse() ** 2 < UNDERSTATED * PRACTICAL**2:
        return False
    power = sum(one.power(one.used) for one in series)  # the number of samples times the motion's mean square
    practical = PRACTICAL**2 * power / max(noise.variance, noise.long_run_variance)
    earned = 0.5 * (state.margin + math.log(max(state.best.samples, 2)))
    return now.strongest > max(earned, UNDERSTATED * practical)


def _contenders(trials: Mapping[tuple[str, ...], Trial], best: Trial) -> list[Trial]:
    """The models worth comparing at the end: the nominal one, the best of each number of effects, and the chosen one with all
    that it is without some of its effects: what each of them brings is judged against these."""
    ranked = sorted(trials.values(), key=lambda t: t.bic())
    kept = {tuple(sorted(t.added)): t for t in [trials[()], best]}
    for count in {len(t.added) for t in ranked if t.added}:
        same = [t for t in ranked if len(t.added) == count][:RIVALS_COMPARED]
        kept = {tuple(sorted(t.added)): t for t in same} | kept
    parts = {key: t for key, t in trials.items() if set(key) < set(best.added)}
    return list((parts | kept).values())
