"""Refit the model with candidate elements, everything free, and compare what they reach.

A comparison needs one noise model for all: it is estimated from what the best candidate leaves, because the effect
that is missing from the others must not be taken for coloured noise.
"""

import math
from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, time_is_up
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
from rhythmid.identify.descent import Descent, descend, out_of_reach
from rhythmid.identify.free_run import FreeRun, prepare_run, start_of, sufficient
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import INTEGRATION, Fit, minimise
from rhythmid.identify.record_scales import scales
from rhythmid.identify.sample_clock.clock import has_clock
from rhythmid.identify.sample_clock.tick_scan import scanned
from rhythmid.identify.series import Series
from rhythmid.model import Model
from rhythmid.parallel import fork_map
from rhythmid.progress import Tell, counted, silent

Array = NDArray[np.float64]
SKETCH, BRIEF, FULL, THOROUGH = 3, 6, 15, 20  # iterations
STEEP = 0.8  # of chi2, below which as many iterations as in a sketch have to bring a descent that goes on
CARRIED_ON = 0.3  # share of the spread of chi2 within which a model is carried to convergence
# share of its ceiling, above which the best of a round has found so little that all minima of all trials are gone through
LITTLE = 0.5
HOPS = 12  # at most, from one minimum to the next
HOP_DISTANCES = 0.25, -0.25, 0.5, -0.5, 1.0, -1.0  # times the distance of minima, that one hop goes
# of the samples: excess of chi2 over that of the best model, beyond which a model is out of the question on unseen data, too: a gain in
# log likelihood of a twentieth per sample, where a few per record decide
EXCESS = 0.1
LEAST_EXCESS = 60.0  # the same for few samples
# of the longest step at most, however often a run is looked at: of samples 20 ms apart to 0.3 ms. Beyond it is no error of integration that
# is left, but jumps, such as a dead band's, that fall elsewhere with every step
MOST_HALVINGS = 6
TOLERANCE = 0.05  # of chi2, at which a trial has converged: far below what an element has to earn


def fine_enough(run: FreeRun, model: Model, starts: Sequence[Array], noise: float) -> FreeRun:
    """The run in steps whose error of integration is far below the `noise` (rms): an element may be stiff, or bend its force within a step."""
    left = MOST_HALVINGS - round(math.log2(run.longest_step / run.max_step))
    return sufficient(run, model, starts, INTEGRATION * noise, left) if left > 0 else run


def _run_of(trial: Trial, series: Sequence[Series], noise: NoiseModel, max_step: float) -> FreeRun:
    """Run of a trial, in steps of `max_step` [s] at most, fine enough for this noise."""
    return fine_enough(
        prepare_run(trial.model, series, max_step), trial.model, trial.starts, noise.variance**0.5
    )


def reach_of(chi2: float, samples: int) -> float:
    """Chi2 that a model has to come to in order to matter beside the best one, with its `chi2` over the `samples`."""
    return chi2 + max(LEAST_EXCESS, EXCESS * samples)


def _fit_proposal(
    proposal: Proposal,
    series: Sequence[Series],
    origin: Origin,
    noise: NoiseModel,
    max_step: float,
    enough: float,
    reach: float,
) -> Outcome:
    """A few iterations from each guess, more from the best as long as it may come to `reach`; no further guess is tried once chi2 falls below `enough`.

    Raises InputError when the model diverges from every guess, or a deadline had passed before the first.
    """
    if time_is_up():
        raise InputError(SPENT)
    whole = prepare_run(proposal.model, series, max_step)
    names = tuple(proposal.model.free)
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
            end = descend(model, fine, names, noise, begin, SKETCH, tolerance=TOLERANCE, similar=steps)
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
    best = _carried_on(best, run, names, noise, reach)
    of_effect = f"{proposal.added[-1]}." if proposal.added else ""
    guessed = [name for name in (proposal.guesses or ({},))[0] if name.startswith(of_effect)]
    flat = _flat(best.model, best.differences[0], guessed)
    if flat and not time_is_up():
        back = best.model.with_values({name: proposal.guesses[0][name] for name in flat})
        again = descend(
            back, run, names, noise, best.starts, BRIEF, None, TOLERANCE, similar=_steps(best, run, flat)
        )
        best = min(best, again, key=lambda end: end.chi2)
    return outcome_of(best, run, noise)


def _carried_on(
    end: Descent, run: FreeRun, names: tuple[str, ...], noise: NoiseModel, reach: float = math.inf
) -> Descent:
    """The descent carried on to `BRIEF` iterations, and beyond as long as it still falls steeply: in a narrow, bent valley it
    comes from far away and can be the deepest in the end. It is given up where it would not come to `reach` at its rate."""
    done, steep, costs = SKETCH, True, [end.chi2]
    while not (end.converged or time_is_up()) and (done < BRIEF or (steep and done < THOROUGH)):
        if len(costs) > 1 and out_of_reach(costs[-2], costs[-1], (THOROUGH - done) / SKETCH, reach):
            break
        end = descend(end.model, run, names, noise, end.starts, SKETCH, None, TOLERANCE, end.differences)
        costs.append(end.chi2)
        done, steep = done + SKETCH, end.chi2 < STEEP * costs[-2]
    return end


def _hops(trial: Trial, series: Sequence[Series]) -> dict[str, float]:
    """Parameters of the newest effect that have many minima, and how far these lie apart."""
    newest = trial.model.term(trial.added[-1]) if trial.added else None
    if newest is None or newest.element.hops is None:
        return {}
    apart = newest.element.hops(scales(series, trial.model))
    return {f"{newest.label}.{name}": distance for name, distance in apart.items()}


def _in_deepest(trial: Trial, series: Sequence[Series], max_step: float) -> Outcome:
    """Where a trial ends in the deepest of the minima that its newest effect has, as far as hops from one to the next lead there."""
    run = _run_of(trial, series, trial.noise, max_step)
    names = tuple(trial.model.free)
    best = descend(trial.model, run, names, trial.noise, trial.starts, 1, None, TOLERANCE, trial.differences)
    for name, distance in _hops(trial, series).items():
        best = _hopped(best, run, names, trial.noise, name, distance)
    return outcome_of(best, run, trial.noise)


def _hopped(
    best: Descent, run: FreeRun, names: tuple[str, ...], noise: NoiseModel, name: str, distance: float
) -> Descent:
    """The deepest of the minima that a parameter has at about this distance, as far as every next one is deeper."""
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
            again = descend(moved, run, names, noise, before.starts, BRIEF, None, TOLERANCE, similar=steps)
            best = min(best, again, key=lambda end: end.chi2)
        if best.chi2 > before.chi2 - 1.0:
            break
    return best


def _flat(model: Model, steps: Array, names: Sequence[str]) -> list[str]:
    """Those of the named parameters that have wandered to where they change nothing: a step large enough to be felt is
    larger than their value. What they did before, when the others were still wrong, says nothing against them now."""
    felt = dict(zip(model.free, steps))
    return [name for name in names if name in felt and abs(felt[name]) > abs(model.value(name))]


def _unstuck(trial: Trial, series: Sequence[Series], max_step: float) -> Trial:
    """The trial with flat parameters of its effects tried again from the elements' own guesses, where that is better: one
    iteration from each, for all others are where they belong, more from the best."""
    best = trial
    if trial.differences is None or time_is_up():
        return best
    for label in trial.added:
        element = trial.element(label)
        names = [f"{label}.{parameter.name}" for parameter in element.parameters]
        flat = _flat(trial.model, trial.differences[0], names)
        if not flat or element.starts is None:
            continue
        guesses = element.starts(scales(series, trial.model))
        known = {tuple(guess[name.rpartition(".")[2]] for name in flat) for guess in guesses}
        run = _run_of(trial, series, trial.noise, max_step)
        free = tuple(trial.model.free)
        steps = steps_by_name(trial.model, run.compiled.layout.states, trial.differences, flat)
        found: list[Descent] = []
        for share in (1.0, *FAINTER):
            for values in sorted(known):
                moved = trial.model.with_values(dict(zip(flat, (share * value for value in values))))
                try:
                    found.append(
                        descend(
                            moved, run, free, trial.noise, trial.starts, 1, tolerance=TOLERANCE, similar=steps
                        )
                    )
                except InputError:
                    continue
        if not found:
            continue
        lead = min(found, key=lambda end: end.chi2)
        end = descend(
            lead.model, run, free, trial.noise, lead.starts, THOROUGH, None, TOLERANCE, lead.differences
        )
        if end.chi2 < best.chi2:
            best = trial_of(trial.added, trial.model, outcome_of(end, run, trial.noise), trial.noise)
    return best


def _steps(end: Descent, run: FreeRun, without: Collection[str]) -> dict[str, float]:
    """Steps of a descent by name, without those of parameters that have moved."""
    return steps_by_name(end.model, run.compiled.layout.states, end.differences, without)


def _extended(model: Model, run: FreeRun, origin: Origin) -> list[Array]:
    """Starts of each series for a structure with other states: those that it shares are kept, new ones begin at rest."""
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
) -> tuple[list[Trial], list[tuple[tuple[str, ...], str]]]:
    """Fit all proposals in parallel, beginning from the `origin`. Returns the trials, best first, and those excluded with the reason.

    A few iterations from each guess first, until chi2 is `enough`; then the promising ones are carried to convergence, as long as
    they may come to `reach`: a chi2 that one has to come to in order to matter.
    """
    goals = list(enough) if enough is not None else [-math.inf] * len(proposals)

    def one(case: tuple[Proposal, float]) -> Outcome:
        return _fit_proposal(case[0], series, origin, noise, max_step, case[1], reach)

    trials: list[Trial] = []
    excluded: list[tuple[tuple[str, ...], str]] = []
    done = fork_map(one, list(zip(proposals, goals)))
    for index, result in counted(done, len(proposals), "fits", tell):
        if isinstance(result, Exception):
            excluded.append((proposals[index].added, str(result)))
        else:
            trials.append(trial_of(proposals[index].added, proposals[index].model, result, noise))
    if not trials or time_is_up():
        return sorted(trials, key=lambda t: t.bic()), excluded
    # many minima are gone through only where that can matter: few descents are as dear
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
    """Whether a trial is near the best of all."""
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
    """The full fit of a trial under a noise model; one that has converged under it is only evaluated, one that would not come to
    `reach` is not carried to convergence."""
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
    """The trials, best first, all under one noise model: those that were fitted under another are fitted again, as far as they may
    come to `reach`; without `iterations` they stay as they are."""
    done = [trial for trial in trials if _settled(trial, noise)]
    others = [trial for trial in trials if not _settled(trial, noise)]

    def one(trial: Trial) -> Outcome:
        run, names = _run_of(trial, series, noise, max_step), tuple(trial.model.free)
        end = descend(
            trial.model,
            run,
            names,
            noise,
            trial.starts,
            iterations,
            None,
            TOLERANCE,
            trial.differences,
            reach,
        )
        return outcome_of(end, run, noise)

    again = [
        trial_of(others[index].added, others[index].model, result, noise)
        for index, result in fork_map(one, others)
        if not isinstance(result, Exception)
    ]
    return sorted([*done, *again], key=lambda trial: trial.bic())


def _settled(trial: Trial, noise: NoiseModel) -> bool:
    """Whether a trial was fitted under this noise model and is at its end, or has to stay where a deadline has left it."""
    return trial.noise is noise and (trial.converged or time_is_up())


def near_under_noise(
    trials: Sequence[Trial], series: Sequence[Series], noise: NoiseModel, max_step: float, near: float
) -> list[Trial]:
    """The trials, best first, under one noise model: as they are, but those `near` the best are fitted again, also from
    guesses of parameters that have wandered to where they change nothing."""
    level = under_noise(trials, series, noise, max_step, 0)
    close = [trial for trial in level if trial.bic() - level[0].bic() < near]
    fitted = [_unstuck(trial, series, max_step) for trial in under_noise(close, series, noise, max_step)]
    known = {trial.added for trial in fitted}
    return sorted([*fitted, *(t for t in level if t.added not in known)], key=lambda trial: trial.bic())
