"""Diagnosis in free run or in windows: the search, the contenders and their evidence, and the fit behind the answer."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rhythmid.deadline import SPENT, deadline, time_is_up
from rhythmid.diagnose.alternatives import alternatives
from rhythmid.diagnose.baseline import Calibration
from rhythmid.diagnose.case import EXPLAINED, WEIGHED, Case, Untried
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
from rhythmid.diagnose.evidence import detectable, prediction
from rhythmid.diagnose.hypothesis import Hypothesis, Kind, Prediction
from rhythmid.diagnose.intervals import finely_stepped, profiled, ticks_followed
from rhythmid.diagnose.location import Dependence, dependences, refitted_map
from rhythmid.diagnose.model_uncertainty import covariance_between
from rhythmid.diagnose.scoring import Scoring
from rhythmid.diagnose.search.forward import EFFECTS_AT_ONCE, Search, search
from rhythmid.diagnose.search.refit import reach_of, whole_fit
from rhythmid.diagnose.search.score_tests import (
    Trajectories,
    trajectories,
    under,
)
from rhythmid.diagnose.search.trial import Trial
from rhythmid.diagnose.selection import Contest, Selection, select
from rhythmid.diagnose.size_error import size_errors, std_beside_others
from rhythmid.diagnose.small_effects import small_effects
from rhythmid.diagnose.verdict import Decision, decide
from rhythmid.elements.catalogue import Catalogue
from rhythmid.identify.command_jitter import command_jitter, weighed
from rhythmid.identify.output_error import Fit, rerun
from rhythmid.identify.record_scales import scales
from rhythmid.identify.robust_covariance import with_robust_covariance
from rhythmid.identify.series import Series
from rhythmid.identify.student import autocorrelation_time
from rhythmid.report.quantity import sentence

# hypotheses that compete beside those of the search, if there is time
OTHER_KINDS = "freed values, longer delays, other places, free functions and related laws"
INTERVALS = "intervals followed along the likelihood, and integration in finer steps"
BEFORE = "what the mismatch of the nominal model depends on"
AGAIN = "what the finally chosen model leaves; what is given is left by the model before it"
SMALL_EFFECTS = "what small effects that no hypothesis names add to the standard deviations"
RERUN = "free runs over the held-out records for the report"


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
    series, unseen = calibration.series, scoring.unseen if case.holdout else ()
    known = case.catalogue.within(scales(series, calibration.fit.model))
    found = search(series, calibration.fit, case.nominal, known, case.pool, case.tell, case.budget)
    case.tell("weighing the hypotheses on data that no fit has seen")
    weighing = _Weighing(case, calibration, known, found, rows_of(series, unseen, found.noise))
    contenders = weighing.contenders([(t, "effects" if t.added else "nominal") for t in found.trials])
    trial = _trial_of(select(weighing.contest(contenders)).chosen, contenders)
    trial, run, contenders, uncompared = weighing.with_other_kinds(trial, contenders)
    case.tell("locating what is left")
    began = time.monotonic()
    after = before = dependences(run, weighing.rows, case.pool)
    refitted = None
    if trial.added:
        before, refitted = weighing.of_the_nominal_model(contenders, time.monotonic() - began)
    maps = weighing.maps(after, refitted, contenders)
    contest = weighing.contest(contenders, maps, uncompared)
    selection = select(contest)
    if selection.chosen.key != trial.key:
        trial = _trial_of(selection.chosen, contenders)
        run = weighing.run_of(trial)
        if not weighing.passed(AGAIN):
            after = dependences(run, weighing.rows, case.pool)
            contest = replace(contest, maps=weighing.maps(after, refitted, contenders))
            selection = select(contest)
            trial = _trial_of(selection.chosen, contenders)
    least = weighing.detectable(contenders, selection.chosen)
    found, errors = weighing.settled(trial, contest, selection)
    nominal_there, chosen_there = weighing.over(unseen, found)
    return FreeRunResult(
        scoring,
        calibration,
        replace(found, excluded=(*found.excluded, *weighing.untried)),
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


@dataclass(eq=False)
class _Weighing:
    """The models of a search and what they are weighed with; `untried` grows by what there is no time for."""

    case: Case
    calibration: Calibration
    catalogue: Catalogue
    found: Search
    rows: Rows
    untried: list[Untried] = field(default_factory=list)

    @property
    def series(self) -> tuple[Series, ...]:
        """The fitted series."""
        return self.calibration.series

    @property
    def step(self) -> float:
        """Largest integration step [s] of any model."""
        return self.found.nominal.run.max_step

    @property
    def reach(self) -> float:
        """The chi2 that a model needs in order to compete."""
        return reach_of(self.found.fit, self.found.noise)

    def skips(self, step: str, skip: bool) -> bool:
        """Whether to skip a step for lack of time; it then counts as untried."""
        if skip:
            self.untried.append(Untried(step, SPENT))
        return skip

    def passed(self, step: str) -> bool:
        """Whether a step that a verdict does not need is skipped."""
        return self.skips(step, self.case.budget.passed(EXPLAINED))

    def contenders(self, trials: Sequence[tuple[Trial, Kind]]) -> list[Contender]:
        """The trials as contenders; those that a deadline leaves out count as untried."""
        with deadline(self.case.budget.at(WEIGHED)):
            made = contend(trials, self.series, self.rows, self.step, self.reach, self.case.tell)
            known = {one.trial.added for one in made}
            for trial, _ in trials if time_is_up() else ():
                self.skips(f"the evidence for {' + '.join(trial.added)}", trial.added not in known)
        return made

    def run_of(self, trial: Trial) -> Trajectories:
        """The run of a trial, fitted under the search's noise."""
        found = self.found
        if trial.key == found.best.key:
            return trajectories(found.fit)
        return trajectories(whole_fit(trial, self.series, found.noise, self.step, pool=self.case.pool))

    def contest(
        self,
        contenders: Sequence[Contender],
        maps: Mapping[str, Prediction] | None = None,
        uncompared: bool = False,
    ) -> Contest:
        """The contest of these contenders and of free `maps`."""
        found = self.found
        return Contest(
            tuple(hypotheses_of(contenders, self.rows, scales(self.series, found.fit.model))),
            maps or {},
            len({score.element.name for one in found.rounds for score in one.scores}),
            self.rows.size,
            PRACTICAL,
            PRACTICAL,
            follows=FOLLOWS,
            cut_short=found.cut_short,
            structured=self.calibration.fit.noise.predictable,
            structured_after=found.noise.predictable,
            uncompared=uncompared,
        )

    def with_other_kinds(
        self, chosen: Trial, contenders: list[Contender]
    ) -> tuple[Trial, Trajectories, list[Contender], bool]:
        """The chosen trial, its run, and the contenders with those of other kinds; whether the budget ended before all were compared.

        If a related law takes the place of an effect, the laws related to the others are tried beside it: with two wrong laws,
        exchanging only one of them may not pay.
        """
        uncompared, run = False, self.run_of(chosen)
        for _ in range(EFFECTS_AT_ONCE):
            more, uncompared = self.of_other_kinds(chosen, run, contenders)
            contenders = [*contenders, *more]
            best = select(self.contest(contenders)).chosen
            if uncompared or best.kind != "effects" or best.key == chosen.key:
                break
            chosen = _trial_of(best, contenders)
            run = self.run_of(chosen)
        return chosen, run, contenders, uncompared

    def of_other_kinds(
        self, chosen: Trial, run: Trajectories, contenders: Sequence[Contender]
    ) -> tuple[list[Contender], bool]:
        """Contenders of other kinds than the search's, and whether the budget ended before all were compared."""
        if self.skips(OTHER_KINDS, self.case.budget.spent):
            return [], True
        case, found = self.case, self.found
        case.tell("trying other kinds of explanation")
        with deadline(case.budget.at(WEIGHED)):
            others = alternatives(
                _nominal(contenders), chosen, self.series, self.catalogue, found.noise, self.step, run, found.rounds,
                [one.trial for one in contenders], self.reach, case.tell,
            )  # fmt: skip
            self.skips(OTHER_KINDS, time_is_up())
            return self.contenders(others), time_is_up()

    def of_the_nominal_model(
        self, contenders: Sequence[Contender], takes: float
    ) -> tuple[list[Dependence], tuple[str, Contender] | None]:
        """What the nominal model's mismatch depends on, and the free map of it, as far as there is time; it `takes` about so long [s]."""
        case, budget = self.case, self.case.budget
        if self.skips(BEFORE, not budget.allows(takes, WEIGHED)):
            return [], None
        case.tell("finding what the mismatch of the nominal model depends on")
        run = trajectories(self.found.nominal)
        before = dependences(run, self.rows, case.pool)
        if budget.spent:
            return before, None
        return before, refitted_map(_nominal(contenders), before, run, self.series, self.rows, self.step)

    def maps(
        self,
        found: Sequence[Dependence],
        refitted: tuple[str, Contender] | None,
        contenders: Sequence[Contender],
    ) -> dict[str, Prediction]:
        """Predictions of the free maps, under the autocorrelation time of the contenders.

        A refitted map replaces the linearised one of the same quantity where it predicts better.
        """
        rows, time = self.rows, remembered(contenders, self.rows)
        maps = {
            one.quantity: prediction(one.found, rows.blocks, time, measured_errors(one.found.error, rows))
            for one in found
        }
        if refitted is not None:
            quantity, one = refitted
            made = prediction(one.found, rows.blocks, time, one.error)
            maps[quantity] = max(maps.get(quantity, made), made, key=lambda each: each.score)
        return maps

    def detectable(self, contenders: Sequence[Contender], chosen: Hypothesis) -> float:
        """The smallest detectable rms in these records, relative to the size that errors are a share of."""
        error = next(one.error for one in contenders if one.trial.key == chosen.key)
        time = autocorrelation_time(error, self.rows.record)
        return detectable(error, time) / max(self.rows.size, 1e-300)

    def settled(
        self, trial: Trial, contest: Contest, selection: Selection
    ) -> tuple[Search, dict[str, float]]:
        """The search with the fit of the chosen `trial`, and the relative standard deviations of its effects' sizes.

        The fit's covariance contains the choice of the model and small missing effects; those of the sizes do not.
        """
        case, chosen = self.case, selection.chosen
        found = _with_best(self.found, trial, case)
        if trial.added and chosen.kind == "effects" and not self.passed(INTERVALS):
            found = _followed(found, case)
            self.skips(INTERVALS, time_is_up())
        self.untried.extend(_unconverged(self.calibration.fit, found))
        between = covariance_between(found.fit.names, chosen, contest.hypotheses)
        unnamed = np.zeros_like(between)
        if not self.passed(SMALL_EFFECTS):
            case.tell("adding to the standard deviations what small effects may change")
            unnamed = small_effects(found, self.catalogue, case)
        fit = with_robust_covariance(found.fit)
        priors = [fit.model.parameters[name].prior for name in fit.names]
        std = std_beside_others(chosen.elements, fit.std, fit.linearisation.jacobian, priors)
        errors = size_errors(fit.model, chosen.elements, std)
        return replace(found, fit=replace(fit, covariance=fit.covariance + between + unnamed)), errors

    def over(self, unseen: Sequence[Series], found: Search) -> tuple[Fit | None, Fit | None]:
        """Free runs of the nominal and the chosen model over separate held-out records."""
        shown = () if unseen and self.passed(RERUN) else unseen
        if shown:
            self.case.tell("running both models over the held-out records")
        before, after = found.nominal, found.fit
        return (
            rerun(before.model, shown, found.noise, before.run.max_step),
            rerun(after.model, shown, found.noise, after.run.max_step),
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


def _unconverged(nominal: Fit, found: Search) -> list[Untried]:
    """Which of the refitted nominal model and the chosen model were stopped by a deadline before convergence."""
    named = {"nominal": nominal, "chosen" if found.best.added else "nominal": found.fit}
    return [
        Untried(f"convergence of the {name} model", SPENT)
        for name, fit in named.items()
        if fit.message == SPENT
    ]


def _with_jitter(scoring: Scoring) -> Calibration:
    """The calibrated nominal model; in free run, the response to a visible jitter of the commands is added to its noise."""
    found = scoring.calibration
    jitter = command_jitter(found.fit) if scoring.kind == "free_run" else None
    if jitter is None:
        return found
    fit = weighed(found.fit, jitter)
    return replace(found, fit=fit, series=fit.run.series, notes=(*found.notes, sentence(jitter.words)))


def _nominal(contenders: Sequence[Contender]) -> Trial:
    return next(one.trial for one in contenders if one.kind == "nominal")


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
