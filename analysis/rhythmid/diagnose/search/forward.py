"""Forward search for missing elements, then backward elimination: the model that explains the records with the fewest effects.

Each round scores the whole catalogue (cheap), refits the most promising elements with all parameters free (expensive), and keeps the
best one if the gain justifies its parameters. Backward elimination then tests every element: whether it can be left out or replaced
by a simpler member of its family or, where there are several effects, by another candidate.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, deadline, time_is_up
from rhythmid.diagnose.case import SEARCHED, Budget, Untried
from rhythmid.diagnose.search.backward import eliminate
from rhythmid.diagnose.search.order import in_best_order
from rhythmid.diagnose.search.proposals import (
    REFITTED,
    WORTH,
    better_of,
    follows_all,
    from_given,
    in_parts,
    pair_proposals,
    proposals,
    refitted,
    restoring_force,
)
from rhythmid.diagnose.search.refit import (
    fine_enough,
    near_under_noise,
    reach_of,
    run_trials,
    under_noise,
    whole_fit,
)
from rhythmid.diagnose.search.round import Round, could_pay, distinct, not_tried, one_round
from rhythmid.diagnose.search.score_tests import under
from rhythmid.diagnose.search.trial import Origin, Trial, contenders
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

SHARE = 5e-4  # share of the gain so far below which a further effect counts as an imperfection of the others
GROUPS = 3  # groups of elements that are refitted in turn for the first effect until one improves the fit
# difference of the criterion within which models are compared again under the noise that they leave, absolute and as a share of the
# best one's gain. A noise model coloured by the missing effect can rank a surrogate first by as much (Silverbox: a ripple before the
# cubic spring by 0.15 % of the gain)
NEAR, NEAR_SHARE = 60.0, 0.01
# gain in the criterion from which further models are examined if the better ones fail under their noise, and their number
PLAIN, SECOND = 100.0, 2
EFFECTS_AT_ONCE = 3  # largest number of effects
OVERTAKEN = 4  # rankings at the end, each under the noise left by the best model of the previous one


@dataclass(frozen=True)
class Search:
    """The result of the search.

    `nominal` is the refitted nominal model, `best` the chosen one (the nominal one when nothing is missing) and `fit` its
    full fit, all under the same `noise`. `trials` are all refitted models, sorted by information criterion. `excluded` are
    those that could not be simulated or were not tried, with the reason. `cut_short` says whether the budget ended the search
    before all effects that scored well were tried.
    """

    nominal: Fit
    best: Trial
    fit: Fit
    noise: NoiseModel
    trials: tuple[Trial, ...]
    rounds: tuple[Round, ...]
    excluded: tuple[Untried, ...]
    cut_short: bool = False


@dataclass(frozen=True)
class _Task:
    """Input of all rounds of a search; `floor` is the smallest standard deviation of a noise model."""

    series: Sequence[Series]
    nominal: Fit
    given: Model
    catalogue: Catalogue
    pool: ThreadPoolExecutor | None
    tell: Tell
    floor: float
    most: int

    @property
    def step(self) -> float:
        """Largest integration step [s] of any model."""
        return self.nominal.run.max_step

    def noise_left(self, trial: Trial, noise: NoiseModel) -> NoiseModel:
        """Noise model of the residual that a model leaves when fitted under another noise model."""
        fit = whole_fit(trial, self.series, noise, self.step, pool=self.pool)
        return noise_of(fit.residuals, self.series, self.floor)


@dataclass(frozen=True)
class _State:
    """The state of a search.

    `best` is the chosen model under the `noise` that it leaves. `here` is the same model under the noise of the last round, from
    which the effects of the catalogue's guesses are removed; `current` is its fit there. `gained` is the improvement of the
    criterion by all effects together.
    """

    best: Trial
    here: Trial
    current: Fit
    noise: NoiseModel
    trials: Mapping[tuple[str, ...], Trial]
    rounds: tuple[Round, ...]
    excluded: tuple[Untried, ...]
    gained: float = 0.0

    @property
    def margin(self) -> float:
        """Required improvement of the criterion by a further effect."""
        return max(WORTH, SHARE * self.gained)

    def with_trials(self, trials: Sequence[Trial]) -> "_State":
        """The state with these trials added."""
        return replace(self, trials={**self.trials, **{one.key: one for one in trials}})

    def without(self, tried: Sequence[Untried]) -> "_State":
        """The state with additional exclusions: models that were not tried or could not be simulated."""
        return replace(self, excluded=(*self.excluded, *tried))


@dataclass(frozen=True)
class _Grant:
    """An accepted model, its gain in the criterion, and the noise that it leaves."""

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
    """Search the catalogue for what the nominal model lacks.

    Parameters
    ----------
    series : the fitted series.
    nominal : the fit of the nominal model to them.
    given : the nominal model as given.
    catalogue : elements that may be missing.
    pool : threads that simulate.
    tell : called with a sentence at the beginning of each step.
    budget : once it is spent no further round begins, and fits in progress return what they have; what was not tried is
        listed in `Search.excluded`.
    most : largest number of effects.
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
    task = _Task(series, nominal, given, catalogue, pool, tell, floor, most)
    state, ended = _begun(task, first), False
    while len(state.best.added) < most and could_pay(state.rounds[-1], state.current, state.margin):
        if budget.spent:
            state, ended = state.without(_cut_off(state)), True
            break
        state, grant = _further(task, state)
        if grant is None:
            break
        state = _with_effect(task, state, grant, last=len(grant.winner.added) >= most)
    cut_short = ended or any(one.reason == SPENT for one in state.excluded)
    if state.best.added and budget.spent:
        state = state.without([Untried("backward elimination", SPENT)])
    elif state.best.added:
        state = _reduced(task, state)
        state = state.without([Untried("part of the backward elimination", SPENT)] if time_is_up() else [])
    best, noise, ranked = _ranked(task, state)
    fit = whole_fit(best, series, noise, task.step, pool=pool)
    return Search(
        under(nominal, noise, pool), best, fit, noise, tuple(ranked), state.rounds, state.excluded, cut_short
    )


def _begun(task: _Task, first: Round) -> _State:
    """The state before any effect, with the first round scored."""
    fit = task.nominal
    felt = felt_starts(fit.model, fit.run, fit.noise, fit.starts, fit.residuals, fit.differences[1])
    base = Trial(
        (), fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), fit.converged, fit.noise, fit.differences,
        start_cost(felt),
    )  # fmt: skip
    lost = not_tried(fit, task.catalogue, first)
    return _State(base, base, fit, fit.noise, {(): base}, (first,), tuple(lost))


def _cut_off(state: _State) -> list[Untried]:
    """What is not tried after the budget is spent.

    The elements that scored best, or if nothing was scored after the last effect, all further effects beside those found.
    """
    added, last = state.best.added, state.rounds[-1]
    if last.added != added:
        return [Untried(f"further effects beside {' and '.join(added)}", SPENT)]
    return [Untried(one.element.name, SPENT) for one, _ in distinct(last.scores, REFITTED)]


def _further(task: _Task, state: _State) -> tuple[_State, _Grant | None]:
    """A model with one more effect, or with two that hide each other; None if none is accepted."""
    state, found = _refitted(task, state)
    # once the best one is accepted, the next round finds what is missing beside it
    state, pairs = _paired(task, state, found, found[0].names[-1] if found else "")
    state, grant = _granted(task, state, better_of([*found, *pairs]))
    if grant is None:
        state, pairs = _paired(task, state, [*found, *pairs], "")
        state, grant = _granted(task, state, pairs)
    return state, grant


def _refitted(task: _Task, state: _State) -> tuple[_State, list[Trial]]:
    """Refit the models proposed by the last round; returns those that improve on the best so far, best first."""
    here, now = state.here, replace(state.rounds[-1], added=state.here.added)
    count = refitted(now, REFITTED if not state.best.added else REFITTED - 1)
    begun = task.series, Origin.of(here), here.noise, task.step
    found, failed = [], []
    # if none improves on the nominal model, the next group: linear scores may overrate a family
    for first in range(0, count * (1 if state.best.added else GROUPS), count):
        proposed, enough = proposals(here.model, now, count, here.chi2, first)
        if any(one.chi2 < here.chi2 for one in found) or not proposed:
            break
        task.tell(f"refitting with {', '.join(p.added[-1] for p in proposed)}")
        others, lost = run_trials(proposed, *begun, enough, tell=task.tell)
        found, failed = better_of([*found, *others]), failed + lost
    known = {trial.key for trial in found}
    untold = [
        one for one in restoring_force(state.current, task.catalogue, here.added) if one.key not in known
    ]
    if not state.best.added and not follows_all(task.nominal):
        untold += from_given(task.nominal, task.given, task.catalogue, here.chi2, task.pool)
    if untold:
        others, lost = run_trials(untold, *begun, tell=task.tell)
        found, failed = better_of([*found, *others]), failed + lost
    # a richer model with a worse fit has ended in a bad minimum
    found = [one for one in found if one.chi2 < here.chi2]
    if parts := list(in_parts(here, now, found)):
        others, lost = run_trials(parts, *begun, tell=task.tell)
        found, failed = better_of([*found, *(one for one in others if one.chi2 < here.chi2)]), failed + lost
    return state.without(failed).with_trials(found), found


def _paired(task: _Task, state: _State, found: Sequence[Trial], known: str) -> tuple[_State, list[Trial]]:
    """Refit pairs of elements that promise more than all models `found`; those that improve on the best so far, best first.

    If an element `known` is given, the pairs also promise more than any with it.
    """
    here, now = state.here, replace(state.rounds[-1], added=state.here.added)
    if len(here.added) + 2 > task.most:
        return state, []
    gained = max((here.bic() - one.bic() for one in found), default=0.0)
    proposed = [one for one in pair_proposals(here, now, gained, known) if one.key not in state.trials]
    if not proposed:
        return state, []
    task.tell(f"refitting with {', '.join(' + '.join(one.added[-2:]) for one in proposed)}")
    made, failed = run_trials(proposed, task.series, Origin.of(here), here.noise, task.step, tell=task.tell)
    made = [one for one in made if one.chi2 < here.chi2]
    return state.without(failed).with_trials(made), made


def _granted(task: _Task, state: _State, found: Sequence[Trial]) -> tuple[_State, _Grant | None]:
    """Accept the refit that explains the records best if it justifies its parameters under the noise that it leaves."""
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
        # the clock's period is sought again beside the effect added after it
        if any(has_clock(top.model, label) for label in top.added[-2:]):
            fit = ticks_sought(fit, task.floor, task.pool)
            sought = replace(top, model=fit.model, starts=fit.starts, converged=False)
        others = [trial for trial in group if trial.added != top.added]
        settled = noise_of(fit.residuals, task.series, task.floor)
        reach = reach_of(fit, settled)
        compared = under_noise([sought, *others, best], task.series, settled, task.step, reach=reach)
        state = state.with_trials(compared)
        winner = compared[0]
        before = next((one for one in compared if one.added == best.added), best)
        gain = before.bic() - winner.bic()
        if winner.added != best.added and gain >= state.margin:
            return state, _Grant(winner, gain, settled)
    # the gains under the noise model of the round do not hold under the noise that the models leave
    return state, None


def _finely_fitted(task: _Task, trial: Trial, noise: NoiseModel) -> Fit:
    """The full fit of a trial, with steps fine enough for its residual.

    An integration error that is negligible beside a mismatch may dominate the residual once the mismatch is explained.
    """
    fit = whole_fit(trial, task.series, noise, task.step, pool=task.pool)
    if time_is_up():
        return fit
    left = noise_of(fit.residuals, task.series, task.floor)
    run = fine_enough(fit.run, fit.model, fit.starts, left.variance**0.5)
    if run is fit.run:
        return fit
    return minimise(fit.model, run, fit.names, noise, fit.starts, pool=task.pool, differences=fit.differences)


def _with_effect(task: _Task, state: _State, grant: _Grant, last: bool) -> _State:
    """The state with one more effect, and with the next round scored unless it is the last one."""
    best = in_best_order(grant.winner, task.series, grant.noise, task.step)
    gained = state.gained + grant.gain + grant.winner.chi2 - best.chi2
    new = " and ".join(label for label in best.added if label not in state.best.added)
    task.tell(
        f"{new} added: the information criterion (BIC) falls by {grant.gain:.0f}; looking for a further effect"
    )
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
        best, task.series, task.catalogue, state.trials, noise, task.step, state.rounds, state.margin,
        reach_of(state.current, noise), task.tell,
    )  # fmt: skip
    state = state.with_trials(list(more.values()))
    if reduced is best:
        return state
    best = in_best_order(reduced, task.series, noise, task.step)
    return replace(state.with_trials([best]), best=best, noise=task.noise_left(best, noise))


def _ranked(task: _Task, state: _State) -> tuple[Trial, NoiseModel, list[Trial]]:
    """The best model when all are compared under the noise that it leaves, that noise model, and all models, best first."""
    best, noise, step = state.best, state.noise, task.step
    ranked = contenders(state.trials, best)
    for turn in range(OVERTAKEN + 1):
        ranked = near_under_noise(ranked, task.series, noise, step, NEAR)
        best = next(one for one in ranked if one.key == best.key)
        ahead = state.margin if ranked[0].free > best.free else WORTH
        if turn == OVERTAKEN or ranked[0].bic() >= best.bic() - ahead or not ranked[0].added:
            break
        best = ranked[0]  # a model rejected under an earlier noise model is now better than the chosen one
        noise = task.noise_left(best, noise)
    return best, noise, ranked


def _most_likely(
    near: Sequence[Trial], series: Sequence[Series], noise: NoiseModel, step: float, floor: float
) -> Trial:
    """The model among several close ones with the smallest innovations, each under a noise model of its own residual.

    The first noise model is coloured by the missing effect and can rank a surrogate slightly better.
    """
    if len(near) == 1 or time_is_up():
        return near[0]

    def left(trial: Trial) -> float:
        return noise_of(whole_fit(trial, series, noise, step).residuals, series, floor).std

    found = {index: std for index, std in fork_map(left, near) if not isinstance(std, Exception)}
    return near[min(found, key=lambda index: (found[index], index), default=0)]
