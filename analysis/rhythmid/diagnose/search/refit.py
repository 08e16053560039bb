"""Refit the model with candidate elements, all parameters free, and compare the results.

A comparison needs one noise model for all candidates. It is estimated from the residual of the best one, because the effect that
the others lack must not be taken for coloured noise.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, time_is_up
from rhythmid.diagnose.case import Untried
from rhythmid.diagnose.search.score_tests import whitened
from rhythmid.diagnose.search.trial import (
    FAINTER,
    Origin,
    Outcome,
    Proposal,
    Trial,
    outcome_of,
    steps_by_name,
    trial_of,
)
from rhythmid.errors import InputError
from rhythmid.identify.descent import NOTHING, Descent, descend, out_of_reach
from rhythmid.identify.free_run import FreeRun, prepare_run, start_of, sufficient
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import INTEGRATION, Fit, minimise
from rhythmid.identify.record_scales import scales
from rhythmid.identify.sample_clock.clock import has_clock
from rhythmid.identify.sample_clock.tick_scan import scanned
from rhythmid.identify.series import Series
from rhythmid.identify.student import autocorrelation_time
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.progress import Tell, counted, silent

Array = NDArray[np.float64]
SKETCH, BRIEF, FULL, THOROUGH = 3, 6, 15, 20  # iterations
STEEP = 0.8  # ratio of chi2 that `SKETCH` iterations must reach for a descent to continue
CARRIED_ON = 0.3  # share of the spread of chi2 up to which a model is fitted to convergence
# ratio to the ceiling above which the best of a round has gained so little that all minima of all trials are searched
LITTLE = 0.5
HOPS = 12  # largest number of hops from one minimum to the next
HOP_DISTANCES = 0.25, -0.25, 0.5, -0.5, 1.0, -1.0  # lengths of a hop, times the distance between minima
# standard errors behind the best model from which another cannot compete on unseen data either
CONCLUSIVE = 5.0
# largest number of halvings of the longest step, over all checks of a run: from samples 20 ms apart to 0.3 ms. An error that remains
# is not due to integration but to jumps, such as a dead band's, whose instants change with every step
MOST_HALVINGS = 6
TOLERANCE = 0.05  # change of chi2 at which a trial has converged, far below the gain that an element needs


def fine_enough(run: FreeRun, model: Model, starts: Sequence[Array], noise: float) -> FreeRun:
    """The run with steps whose integration error is far below the `noise` (rms), also for stiff elements and kinks."""
    left = MOST_HALVINGS - round(math.log2(run.longest_step / run.max_step))
    return sufficient(run, model, starts, INTEGRATION * noise, left) if left > 0 else run


def _run_of(trial: Trial, series: Sequence[Series], noise: NoiseModel, max_step: float) -> FreeRun:
    """The run of a trial, with steps of at most `max_step` [s], fine enough for this noise."""
    return fine_enough(
        prepare_run(trial.model, series, max_step), trial.model, trial.starts, noise.variance**0.5
    )


def _descent(
    model: Model,
    run: FreeRun,
    noise: NoiseModel,
    starts: Sequence[Array],
    iterations: int,
    differences: tuple[Array, Array] | None = None,
    similar: Mapping[str, float] = NOTHING,
    reach: float = math.inf,
) -> Descent:
    """The descent of all free parameters of a model; see `descend`."""
    names = tuple(model.free)
    return descend(model, run, names, noise, starts, iterations, None, TOLERANCE, differences, reach, similar)


def reach_of(best: Fit, noise: NoiseModel) -> float:
    """Chi2 under a noise model that a model must reach to compete with the best one.

    If the best model is true, and another one's predictions differ from its by D (sum of squares in units of the noise), chi2 rises by
    D, with a standard deviation of 2 √(D t). Here t is the autocorrelation time of the best model's errors: 1 for noise, longer for motion
    that the model does not explain.
    """
    white = whitened(best, best.residuals, noise)
    record = np.repeat(np.arange(len(white)), [len(one) for one in white])
    error = np.concatenate(white)
    return float(error @ error) + (2.0 * CONCLUSIVE) ** 2 * autocorrelation_time(error, record)


def _fit_proposal(
    proposal: Proposal,
    series: Sequence[Series],
    origin: Origin,
    noise: NoiseModel,
    max_step: float,
    enough: float,
    reach: float,
) -> Outcome:
    """Fit a structure: a few iterations from each guess, more from the best one as long as it may reach `reach`.

    No further guess is tried once chi2 is below `enough`. Raises InputError when the model diverges from every guess, or when a
    deadline has passed before the first.
    """
    if time_is_up():
        raise InputError(SPENT)
    whole = prepare_run(proposal.model, series, max_step)
    best: Descent | None = None
    run = whole
    failure: InputError | None = None
    ticks: list[dict[str, float]] = []
    steps = dict(origin.steps)
    if proposal.added and has_clock(proposal.model, proposal.added[-1]):
        begin = _extended(proposal.model, whole, origin)
        ticks = scanned(proposal.model, series, begin, noise)
    for guess in (*ticks, *proposal.guesses, *proposal.faint):
        if guess in proposal.faint and best is not None and best.chi2 < proposal.ceiling:
            break
        model = proposal.model.with_values(guess)
        try:
            begin = _extended(model, whole, origin)
            fine = fine_enough(whole, model, begin, noise.variance**0.5)
            end = _descent(model, fine, noise, begin, SKETCH, similar=steps)
        except InputError as error:
            failure = error
            continue
        steps = _steps(end, fine, [name for name in guess if name not in origin.steps])
        if best is None or end.chi2 < best.chi2:
            best, run = end, fine
        if best.chi2 < enough or time_is_up():
            break
    if best is None:
        assert failure is not None
        raise failure
    run = fine_enough(run, best.model, best.starts, noise.variance**0.5)
    best = _carried_on(best, run, noise, reach)
    of_effect = f"{proposal.added[-1]}." if proposal.added else ""
    guessed = [name for name in (proposal.guesses or ({},))[0] if name.startswith(of_effect)]
    flat = _flat(best.model, best.differences[0], guessed)
    if flat and not time_is_up():
        back = best.model.with_values({name: proposal.guesses[0][name] for name in flat})
        again = _descent(back, run, noise, best.starts, BRIEF, similar=_steps(best, run, flat), reach=reach)
        best = min(best, again, key=lambda end: end.chi2)
    return outcome_of(best, run, noise)


def _carried_on(end: Descent, run: FreeRun, noise: NoiseModel, reach: float = math.inf) -> Descent:
    """Continue the descent to `BRIEF` iterations, and further as long as chi2 falls steeply.

    In a narrow, curved valley a descent is slow but may end in the deepest minimum. It is abandoned if at its rate it would not
    reach `reach`.
    """
    done, steep, costs = SKETCH, True, [end.chi2]
    while not (end.converged or time_is_up()) and (done < BRIEF or (steep and done < THOROUGH)):
        if len(costs) > 1 and out_of_reach(costs[-2], costs[-1], (THOROUGH - done) / SKETCH, reach):
            break
        end = _descent(end.model, run, noise, end.starts, SKETCH, end.differences)
        costs.append(end.chi2)
        done, steep = done + SKETCH, end.chi2 < STEEP * costs[-2]
    return end


def _hops(trial: Trial, series: Sequence[Series]) -> dict[str, float]:
    """Parameters of the newest effect that have many minima, with the distance between them."""
    newest = trial.model.term(trial.added[-1]) if trial.added else None
    if newest is None or newest.element.hops is None:
        return {}
    apart = newest.element.hops(scales(series, trial.model))
    return {f"{newest.label}.{name}": distance for name, distance in apart.items()}


def _in_deepest(trial: Trial, series: Sequence[Series], max_step: float) -> Outcome:
    """The outcome of a trial in the deepest minimum of its newest effect that hops from one minimum to the next reach."""
    run = _run_of(trial, series, trial.noise, max_step)
    best = _descent(trial.model, run, trial.noise, trial.starts, 1, trial.differences)
    for name, distance in _hops(trial, series).items():
        best = _hopped(best, run, trial.noise, name, distance)
    return outcome_of(best, run, trial.noise)


def _hopped(best: Descent, run: FreeRun, noise: NoiseModel, name: str, distance: float) -> Descent:
    """Hop along a parameter whose minima lie about this distance apart, as long as the next one is deeper."""
    low, high = best.model.parameters[name].bounds
    for _ in range(HOPS):
        if time_is_up():
            break
        before = best
        for value in (before.model.value(name) + hop * distance for hop in HOP_DISTANCES):
            if not low < value < high:
                continue
            moved = before.model.with_values({name: value})
            steps = _steps(before, run, [name])
            again = _descent(moved, run, noise, before.starts, BRIEF, similar=steps)
            best = min(best, again, key=lambda end: end.chi2)
        if best.chi2 > before.chi2 - 1.0:
            break
    return best


def _flat(model: Model, steps: Array, names: Sequence[str]) -> list[str]:
    """Parameters among those named that have no effect at their present values.

    The step that would change the output is larger than the value. They may have drifted there while the other parameters were
    still wrong, so they deserve another try.
    """
    felt = dict(zip(model.free, steps))
    return [name for name in names if name in felt and abs(felt[name]) > abs(model.value(name))]


def _unstuck(trial: Trial, series: Sequence[Series], max_step: float) -> Trial:
    """Try parameters that have no effect again from the elements' own guesses; the trial is kept if that is not better.

    One iteration from each guess, because all other parameters are at their best values; then more from the best guess.
    """
    best = trial
    if trial.differences is None or time_is_up():
        return best
    for label in trial.added:
        element = trial.element(label)
        names = [f"{label}.{parameter.name}" for parameter in element.parameters]
        flat = _flat(trial.model, trial.differences[0], names)
        if not flat or element.starts is None:
            continue
        guesses = element.first_guesses(scales(series, trial.model))
        known = {tuple(guess[name.rpartition(".")[2]] for name in flat) for guess in guesses}
        run = _run_of(trial, series, trial.noise, max_step)
        steps = steps_by_name(trial.model, run.compiled.layout.states, trial.differences, flat)
        found: list[Descent] = []
        for share in (1.0, *FAINTER):
            for values in sorted(known):
                moved = trial.model.with_values(dict(zip(flat, (share * value for value in values))))
                with suppress(InputError):
                    found.append(_descent(moved, run, trial.noise, trial.starts, 1, similar=steps))
        if not found:
            continue
        lead = min(found, key=lambda end: end.chi2)
        end = _descent(lead.model, run, trial.noise, lead.starts, THOROUGH, lead.differences)
        if end.chi2 < best.chi2:
            best = trial_of(trial.added, trial.model, outcome_of(end, run, trial.noise), trial.noise)
    return best


def _steps(end: Descent, run: FreeRun, without: Collection[str]) -> dict[str, float]:
    """Difference steps of a descent by name, except those of parameters that have moved."""
    return steps_by_name(end.model, run.compiled.layout.states, end.differences, without)


def _extended(model: Model, run: FreeRun, origin: Origin) -> list[Array]:
    """Initial states of each series for a structure with other states: shared states are kept, new ones begin at rest."""
    found = []
    for index, start in enumerate(origin.starts):
        fresh = start_of(model, run, index, float(start[0]), float(start[1]))
        for place, name in enumerate(run.compiled.layout.states):
            if name in origin.states:
                fresh[place] = start[origin.states.index(name)]
        found.append(fresh)
    return found


def run_trials(
    proposals: Sequence[Proposal],
    series: Sequence[Series],
    origin: Origin,
    noise: NoiseModel,
    max_step: float,
    enough: Sequence[float] | None = None,
    reach: float = math.inf,
    tell: Tell = silent,
) -> tuple[list[Trial], list[Untried]]:
    """Fit all proposals in parallel, beginning from the `origin`.

    First a few iterations from each guess, until chi2 is below `enough`. The promising trials are then fitted to convergence, as
    long as they may reach `reach`, the chi2 that a competitive model needs.

    Returns the trials, best first, and the excluded structures with the reasons.
    """
    goals = list(enough) if enough is not None else [-math.inf] * len(proposals)

    def one(case: tuple[Proposal, float]) -> Outcome:
        return _fit_proposal(case[0], series, origin, noise, max_step, case[1], reach)

    trials: list[Trial] = []
    excluded: list[Untried] = []
    done = counted(fork_map(one, list(zip(proposals, goals))), len(proposals), "fits", tell)
    for index, result in _in_order(done):
        if isinstance(result, Exception):
            excluded.append(Untried(" + ".join(proposals[index].added), str(result)))
        else:
            trials.append(trial_of(proposals[index].added, proposals[index].model, result, noise))
    if not trials or time_is_up():
        return sorted(trials, key=lambda t: t.bic()), excluded
    # all minima are searched only where that can matter: this needs more descents than any other step
    ceilings = {proposal.added: proposal.ceiling for proposal in proposals}
    lowest = min(trial.chi2 for trial in trials)
    hopping = [
        i
        for i, t in enumerate(trials)
        if _hops(t, series)
        and t.chi2 < ceilings[t.added]
        and (lowest > LITTLE * ceilings[t.added] or _promising(t, trials))
    ]
    for place, result in fork_map(lambda i: _in_deepest(trials[i], series, max_step), hopping):
        if not isinstance(result, Exception):
            before = trials[hopping[place]]
            trials[hopping[place]] = trial_of(before.added, before.model, result, noise)
    open_ones = [t for t in trials if not t.converged and _promising(t, trials)]
    finished = under_noise(open_ones, series, noise, max_step, THOROUGH, reach)
    settled = {t.added for t in finished}
    return sorted(
        [*finished, *(t for t in trials if t.added not in settled)], key=lambda t: t.bic()
    ), excluded


def _promising(trial: Trial, trials: Sequence[Trial]) -> bool:
    """Whether a trial's chi2 is near the best one."""
    best, worst = min(one.chi2 for one in trials), max(one.chi2 for one in trials)
    return trial.chi2 - best <= CARRIED_ON * max(worst - best, trial.samples)


def whole_fit(
    trial: Trial,
    series: Sequence[Series],
    noise: NoiseModel,
    max_step: float,
    pool: ThreadPoolExecutor | None = None,
    reach: float = math.inf,
) -> Fit:
    """The full fit of a trial under a noise model.

    A trial that has converged under it is only evaluated. One that would not reach `reach` is not fitted to convergence.
    """
    run = _run_of(trial, series, noise, max_step)
    return minimise(
        trial.model, run, tuple(trial.model.free), noise, trial.starts, 1 if _settled(trial, noise) else FULL, pool,
        differences=trial.differences, reach=reach,
    )  # fmt: skip


def under_noise(
    trials: Sequence[Trial],
    series: Sequence[Series],
    noise: NoiseModel,
    max_step: float,
    iterations: int = FULL,
    reach: float = math.inf,
) -> list[Trial]:
    """The trials under one noise model, best first.

    Trials fitted under another one are refitted, as far as they may reach `reach`; with `iterations` 0 they are only evaluated.
    """
    done = [trial for trial in trials if _settled(trial, noise)]
    others = [trial for trial in trials if not _settled(trial, noise)]

    def one(trial: Trial) -> Outcome:
        run = _run_of(trial, series, noise, max_step)
        end = _descent(trial.model, run, noise, trial.starts, iterations, trial.differences, reach=reach)
        return outcome_of(end, run, noise)

    again = [
        trial_of(others[index].added, others[index].model, result, noise)
        for index, result in _in_order(fork_map(one, others))
        if not isinstance(result, Exception)
    ]
    return sorted([*done, *again], key=lambda trial: trial.bic())


def _in_order(done: Iterable[tuple[int, Outcome | Exception]]) -> list[tuple[int, Outcome | Exception]]:
    """Results in the order of their items, so that ties do not depend on which worker finishes first."""
    return sorted(done, key=lambda result: result[0])


def _settled(trial: Trial, noise: NoiseModel) -> bool:
    """Whether a trial was fitted under this noise model and has converged, or no time is left."""
    return trial.noise is noise and (trial.converged or time_is_up())


def near_under_noise(
    trials: Sequence[Trial], series: Sequence[Series], noise: NoiseModel, max_step: float, near: float
) -> list[Trial]:
    """The trials under one noise model, best first.

    Those `near` the best are refitted, also from new guesses of parameters that have no effect at their present values. The others
    are only evaluated.
    """
    level = under_noise(trials, series, noise, max_step, 0)
    close = [trial for trial in level if trial.bic() - level[0].bic() < near]
    fitted = [_unstuck(trial, series, max_step) for trial in under_noise(close, series, noise, max_step)]
    known = {trial.added for trial in fitted}
    return sorted([*fitted, *(t for t in level if t.added not in known)], key=lambda trial: trial.bic())
