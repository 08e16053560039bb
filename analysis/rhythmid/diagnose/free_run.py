"""Diagnosis in free run or in windows: the search, the contenders and their evidence, and the fit behind the answer."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from rhythmid.deadline import SPENT, deadline, time_is_up
from rhythmid.diagnose.alternatives import alternatives
from rhythmid.diagnose.baseline import Calibration
from rhythmid.diagnose.case import EXPLAINED, WEIGHED, Case
from rhythmid.diagnose.constants import FOLLOWS, PRACTICAL
from rhythmid.diagnose.contenders import (
    Contender,
    Rows,
    contend,
    hypotheses_of,
    measured_errors,
    remembered,
    rows_of,
)
from rhythmid.diagnose.discrepancy import mean_product
from rhythmid.diagnose.evidence import detectable, prediction
from rhythmid.diagnose.fine_steps import finely_stepped
from rhythmid.diagnose.free_functions import motion_maps
from rhythmid.diagnose.hypothesis import Hypothesis, Kind, Prediction
from rhythmid.diagnose.intervals import profiled
from rhythmid.diagnose.location import Dependence, dependences
from rhythmid.diagnose.model_uncertainty import covariance_between
from rhythmid.diagnose.refitted_map import refitted_map
from rhythmid.diagnose.scoring import Scoring
from rhythmid.diagnose.search.forward import Search, search
from rhythmid.diagnose.search.refit import reach_of, whole_fit
from rhythmid.diagnose.search.round import distinct
from rhythmid.diagnose.search.score_tests import (
    Trajectories,
    changes_of,
    sizes_along,
    trajectories,
    under,
    whitened,
)
from rhythmid.diagnose.search.trial import Trial
from rhythmid.diagnose.selection import Contest, Selection, select
from rhythmid.diagnose.shape import shape_of
from rhythmid.diagnose.size_error import size_errors
from rhythmid.diagnose.tick_interval import ticks_followed
from rhythmid.diagnose.verdict import Decision, decide
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.element import Scales
from rhythmid.identify.command_jitter import command_jitter, weighed
from rhythmid.identify.covariance import covariance_of
from rhythmid.identify.output_error import Fit, rerun
from rhythmid.identify.record_scales import scales
from rhythmid.identify.robust_covariance import with_robust_covariance
from rhythmid.identify.student import autocorrelation_time

# hypotheses that compete beside those of the search, if there is time
OTHER_KINDS = ("freed values, longer delays, other places, free functions and related laws",)
INTERVALS = ("intervals followed along the likelihood, and integration in finer steps",)
BEFORE = ("what the mismatch of the nominal model depends on",)
AGAIN = ("what the model that was chosen in the end leaves, which is told of the one before it",)
SMALL_EFFECTS = ("what small effects that no hypothesis names add to the standard deviations",)
RERUN = ("free runs over the held-out records for the report",)


@dataclass(frozen=True)
class FreeRunResult:
    """All data behind an answer from free-run or window scoring.

    `search` holds the chosen model as its `best`, with its fit. `before` and `after` are the free maps beside the nominal and
    the chosen model. `unseen_nominal` and `unseen_augmented` are their runs over separate held-out records. `size_errors` are
    the relative standard deviations of the chosen effects' sizes, by label.
    """

    scoring: Scoring
    calibration: Calibration
    search: Search
    before: tuple[Dependence, ...]
    after: tuple[Dependence, ...]
    unseen_nominal: Fit | None
    unseen_augmented: Fit | None
    contest: Contest
    selection: Selection
    decision: Decision
    detectable: float
    size_errors: Mapping[str, float]


def free_run(case: Case, scoring: Scoring) -> FreeRunResult:
    """Search, weigh and decide; steps that the case's budget left no time for are listed in the search's `excluded`."""
    with deadline(case.budget.at(1.0)):
        return _free_run(case, scoring)


def _free_run(case: Case, scoring: Scoring) -> FreeRunResult:
    calibration = _with_jitter(scoring)
    seen = list(calibration.series)
    unseen = tuple(scoring.unseen) if case.holdout else ()
    known = case.catalogue.within(scales(seen, calibration.fit.model))
    found = search(seen, calibration.fit, case.nominal, known, case.pool, case.tell, case.budget)
    case.tell("weighing the hypotheses on data that no fit has seen")
    step = found.nominal.run.max_step
    rows = rows_of(seen, unseen, found.noise)
    kinds: list[tuple[Trial, Kind]] = [(t, "effects" if t.added else "nominal") for t in found.trials]
    reach = reach_of(found.fit.chi2, found.fit.samples)
    with deadline(case.budget.at(WEIGHED)):
        contenders = contend(kinds, seen, rows, step, reach, case.tell)
        found = _weighed(found, found.trials, contenders)
    run = trajectories(found.fit)
    sizes = scales(seen, found.fit.model)
    structured = calibration.fit.noise.predictable
    chosen = select(_contest(contenders, {}, rows, found, run, sizes, structured)).chosen
    trial = _trial_of(chosen, contenders)
    if trial.added != found.best.added:
        run = trajectories(whole_fit(trial, seen, found.noise, step, pool=case.pool))
    nominal = next(one.trial for one in contenders if one.kind == "nominal")
    uncompared = False
    if case.budget.spent:
        found, uncompared = _untried(found, OTHER_KINDS), True
    elif chosen.kind != "freed_value":
        weighed = [one.trial for one in contenders]
        case.tell("trying other kinds of explanation")
        with deadline(case.budget.at(WEIGHED)):
            others = alternatives(
                nominal, trial, seen, known, found.noise, step, run, found.rounds, weighed, reach, case.tell
            )
            found = _told(found, OTHER_KINDS)
            more = contend(others, seen, rows, step, reach, case.tell)
            found = _weighed(found, [one for one, _ in others], more)
            uncompared = time_is_up()
        contenders += more
    case.tell("locating what is left")
    began = time.monotonic()
    after = dependences(run, rows, case.pool)
    took = time.monotonic() - began
    refitted = None
    before = after
    if trial.added and not case.budget.allows(took, WEIGHED):
        before, found = [], _untried(found, BEFORE)
    elif trial.added:
        case.tell("finding what the mismatch of the nominal model depends on")
        nominal_run = trajectories(found.nominal)
        before = dependences(nominal_run, rows, case.pool)
        if not case.budget.spent:
            refitted = refitted_map(nominal, before, nominal_run, seen, rows, step)
    maps = _maps(after, refitted, contenders, rows)
    contest = replace(_contest(contenders, maps, rows, found, run, sizes, structured), uncompared=uncompared)
    selection = select(contest)
    if selection.chosen.key != trial.added:
        trial = _trial_of(selection.chosen, contenders)
        run = trajectories(whole_fit(trial, seen, found.noise, step, pool=case.pool))
        if case.budget.passed(EXPLAINED):
            found = _untried(found, AGAIN)
        else:
            after = dependences(run, rows, case.pool)
            contest = replace(contest, maps=_maps(after, refitted, contenders, rows))
            selection = select(contest)
            trial = _trial_of(selection.chosen, contenders)
    found = _with_best(found, trial, case)
    least = _detectable(contenders, selection.chosen, rows)
    if trial.added and selection.chosen.kind == "effects":
        late = case.budget.passed(EXPLAINED)
        found = _untried(found, INTERVALS) if late else _told(_followed(found, case), INTERVALS)
    found = replace(found, excluded=(*found.excluded, *_unconverged(calibration.fit, found)))
    between = covariance_between(found.fit.names, selection.chosen, contest.hypotheses)
    unnamed = np.zeros((len(found.fit.names),) * 2)
    if case.budget.passed(EXPLAINED):
        found = _untried(found, SMALL_EFFECTS)
    else:
        case.tell("adding to the standard deviations what small effects may change")
        unnamed = _unnamed(found, known, case)
    shown = unseen
    if unseen and case.budget.passed(EXPLAINED):
        shown, found = (), _untried(found, RERUN)
    fit = with_robust_covariance(found.fit)
    errors = size_errors(fit.model, selection.chosen.elements, fit.std)
    if shown:
        case.tell("running both models over the held-out records")
    found = replace(found, fit=replace(fit, covariance=fit.covariance + between + unnamed))
    nominal_there, chosen_there = (
        rerun(one.model, shown, found.noise, one.run.max_step) for one in (found.nominal, found.fit)
    )
    return FreeRunResult(
        scoring,
        calibration,
        found,
        tuple(before),
        tuple(after),
        nominal_there,
        chosen_there,
        contest,
        selection,
        decide(contest, selection, least, errors),
        least,
        errors,
    )


def _followed(found: Search, case: Case) -> Search:
    """Refine the fit and the intervals of the chosen model as far as there is time."""
    for step in (finely_stepped, profiled, ticks_followed):
        if time_is_up():
            break
        if step is profiled:
            case.tell("following the likelihood to the ends of the intervals")
        found = step(found, case.pool)
    return found


def _told(found: Search, untried: tuple[str, ...]) -> Search:
    """The search with `untried` added to its exclusions if time is up."""
    return _untried(found, untried) if time_is_up() else found


def _untried(found: Search, what: tuple[str, ...]) -> Search:
    """The search with `what` added to its exclusions for lack of time."""
    return replace(found, excluded=(*found.excluded, (what, SPENT)))


def _weighed(found: Search, trials: Sequence[Trial], contenders: Sequence[Contender]) -> Search:
    """The search, extended if time is up by the fitted models that were not weighed on unseen data."""
    if not time_is_up():
        return found
    known = {one.trial.added for one in contenders}
    for trial in trials:
        if trial.added not in known:
            found = _untried(found, (f"the evidence for {' + '.join(trial.added)}",))
    return found


def _unconverged(nominal: Fit, found: Search) -> list[tuple[tuple[str, ...], str]]:
    """Which of the refitted nominal model and the chosen model were stopped by a deadline before convergence."""
    named = {"nominal": nominal, "chosen" if found.best.added else "nominal": found.fit}
    return [
        ((f"convergence of the {name} model",), SPENT) for name, fit in named.items() if fit.message == SPENT
    ]


def _unnamed(found: Search, catalogue: Catalogue, case: Case) -> NDArray[np.float64]:
    """Mean product (p, p) of the fit's parameter errors due to small effects that it lacks.

    The effects are: for each element that the model may lack, the guess with the best score in the last round; and forces
    that are arbitrary functions of position or velocity.
    """
    fit = found.fit
    made = np.zeros((len(fit.names), len(fit.names)))
    run = trajectories(fit)
    lacking = candidates(catalogue, fit.model.setting, sizes_along(run)).tried
    names = {element.name for element, _ in lacking}
    scored = distinct(found.rounds[-1].scores, len(catalogue)) if found.rounds else []
    tried = [(one.element, dict(one.values)) for one, _ in scored if one.element.name in names]
    std = np.array([fit.std[name] for name in fit.names])
    known = np.isfinite(std) & (std > 0.0)
    if not known.any():
        return made
    line = fit.linearisation
    maps = [column for one in motion_maps(run, case.pool) for column in one.columns]
    # filled in place: for long records a second copy of all columns would be too large
    columns = np.empty((len(line.residual), len(tried) + len(maps)), order="F")
    count = 0
    for outputs in chain((one.outputs for one in changes_of(run, tried, case.pool)), maps):
        columns[:, count] = line.without_starts(whitened(fit, outputs, fit.noise))
        count += 1
    columns = columns[:, :count]
    priors = [fit.model.parameters[name].prior for name, one in zip(fit.names, known) if one]
    inverse = covariance_of(line.jacobian[:, known], priors)
    made[np.ix_(known, known)] = mean_product(line.jacobian[:, known], line.residual, columns, inverse)
    return made


def _with_jitter(scoring: Scoring) -> Calibration:
    """The calibrated nominal model; in free run, the response to a visible jitter of the commands is added to its noise."""
    found = scoring.calibration
    jitter = command_jitter(found.fit) if scoring.kind == "free_run" else None
    if jitter is None:
        return found
    fit = weighed(found.fit, jitter)
    note = f"{jitter.words[0].upper()}{jitter.words[1:]}."
    return replace(found, fit=fit, series=fit.run.series, notes=(*found.notes, note))


def _trial_of(hypothesis: Hypothesis, contenders: Sequence[Contender]) -> Trial:
    return next(one.trial for one in contenders if one.trial.key == hypothesis.key)


def _with_best(found: Search, trial: Trial, case: Case) -> Search:
    """The search with another chosen model."""
    if trial.key == found.best.key:
        return found
    fit = whole_fit(trial, found.fit.run.series, found.noise, found.fit.run.max_step, pool=case.pool)
    nominal = under(found.nominal, found.noise, case.pool)
    others = [one for one in found.trials if one.added != trial.added]
    trials = tuple(sorted([*others, trial], key=lambda one: one.bic()))
    return replace(found, best=trial, fit=fit, nominal=nominal, trials=trials)


def _contest(
    contenders: Sequence[Contender],
    maps: Mapping[str, Prediction],
    rows: Rows,
    found: Search,
    run: Trajectories,
    sizes: Scales,
    structured: float,
) -> Contest:
    names = {score.element.name for one in found.rounds for score in one.scores}

    def shape(trial: Trial) -> dict[str, float]:
        return shape_of(trial.model, trial.added, run, sizes)

    hypotheses = tuple(hypotheses_of(contenders, rows, shape))
    return Contest(
        hypotheses,
        maps,
        len(names),
        rows.size,
        PRACTICAL,
        PRACTICAL,
        follows=FOLLOWS,
        cut_short=found.cut_short,
        structured=structured,
        structured_after=found.noise.predictable,
    )


def _maps(
    found: Sequence[Dependence],
    refitted: tuple[str, Contender] | None,
    contenders: Sequence[Contender],
    rows: Rows,
) -> dict[str, Prediction]:
    """Predictions of the free maps, under the autocorrelation time of the contenders.

    A refitted map replaces the linearised one of the same quantity where it predicts better.
    """
    time = remembered(contenders, rows)
    maps = {
        one.quantity: prediction(one.found, rows.blocks, time, measured_errors(one.found.error, rows))
        for one in found
    }
    if refitted is not None:
        quantity, one = refitted
        made = prediction(one.found, rows.blocks, time, one.error)
        maps[quantity] = max(maps[quantity], made, key=lambda each: each.score) if quantity in maps else made
    return maps


def _detectable(contenders: Sequence[Contender], chosen: Hypothesis, rows: Rows) -> float:
    """The smallest detectable rms in these records, relative to the size that errors are a share of."""
    error = next(one.error for one in contenders if one.trial.key == chosen.key)
    return detectable(error, autocorrelation_time(error, rows.record)) / max(rows.size, 1e-300)
