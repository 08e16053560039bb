"""Diagnose: detect, locate, name, model, show.

From records and a nominal model to a verdict: select the records, choose how to score them, search the catalogue for what
the nominal model lacks, weigh the hypotheses on data that no fit has seen, and report how certain the answer is.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from threadpoolctl import threadpool_limits

from rhythmid.deadline import SPENT, deadline, time_is_up
from rhythmid.diagnose.admission import Admitted, admitted
from rhythmid.diagnose.agreement import HOW, UNSETTLED, contradictions, effort_suffices
from rhythmid.diagnose.answer.compose import compose
from rhythmid.diagnose.answer.compose_effort import compose_effort
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.baseline import check_free
from rhythmid.diagnose.case import LEAST_CALIBRATION, SEARCHED, Budget, Case, Untried
from rhythmid.diagnose.constants import DRIVES_IT, QUASI_STATIC
from rhythmid.diagnose.effort.found_delay import with_found_delay
from rhythmid.diagnose.effort.run import EffortResult, effort_run
from rhythmid.diagnose.effort.search import MOST_EFFECTS
from rhythmid.diagnose.free_map import without_free_maps
from rhythmid.diagnose.free_run import FreeRunResult, free_run
from rhythmid.diagnose.replay import ledger
from rhythmid.diagnose.scoring import settle
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.admissible import admissible
from rhythmid.identify.declared import with_declared
from rhythmid.identify.harmonic_likelihood import DELAYS
from rhythmid.identify.inverse_dynamics.applicability import Applicability, applicable
from rhythmid.identify.joint_covariance import JointCovariance
from rhythmid.identify.plausibility import BACK, check_plausible, shift
from rhythmid.identify.record_zero import without_record_zero
from rhythmid.identify.series import Series, prepare
from rhythmid.model import Model
from rhythmid.parallel import cores
from rhythmid.progress import Tell
from rhythmid.record.record import Record
from rhythmid.record.same_recording import check_held_out
from rhythmid.result import Result, Row, axis_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

    from rhythmid.body.machine import Machine
    from rhythmid.record.joint_record import JointRecord

BY_EFFORT, BY_MOTION = "scoring by the recorded effort", "scoring by the motion, in free run or in windows"
ANOTHER = "another scoring mode"


@dataclass(frozen=True)
class Answer(Result):
    """A diagnosis, the augmented model, and everything they are based on.

    Attributes
    ----------
    diagnosis
        Verdict, names, sizes, hypotheses and rejections: the content of `diagnose --json`.
    model
        The nominal model with the missing effects added, refitted.
    result
        All data on which the decision is based.

    Examples
    --------
    `answer.diagnosis.verdict`, `answer.diagnosis.missing` and `answer.model` are what most callers read; see `diagnose`.
    """

    diagnosis: Diagnosis
    model: Model
    result: FreeRunResult | EffortResult

    @property
    def block(self) -> int:
        """Number of samples averaged before the comparison."""
        return self.result.calibration.series[0].block if isinstance(self.result, FreeRunResult) else 1

    @property
    def stands(self) -> bool:
        """Whether the answer states names."""
        return self.diagnosis.verdict == "missing_physics"

    @property
    def headline(self) -> str:
        """The verdict in a few sentences."""
        return self.diagnosis.summary

    def saying(self, notes: Sequence[str] = (), excluded: Sequence[Untried] = ()) -> "Answer":
        """The answer with more notes, and with more that was not tried."""
        found = self.diagnosis
        more = replace(found, notes=(*found.notes, *notes), excluded=(*found.excluded, *excluded))
        return replace(self, diagnosis=more)

    @property
    def covariance(self) -> JointCovariance:
        """Covariance of the chosen model's parameters, including the uncertainty of the choice of the model.

        Raises InputError for effort scoring, whose standard deviations have no covariances.
        """
        if not isinstance(self.result, FreeRunResult):
            raise InputError("parameters that were fitted to the recorded effort have no joint covariance")
        return self.result.search.fit.joint_covariance

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `diagnose --json`."""
        return self.diagnosis.to_dict()

    def tables(self) -> Mapping[str, Sequence[Row]]:
        """`hypotheses`, the best first; `parameters` of the model; `missing` effects' parameters; `rejections`."""
        found = self.to_dict()
        return {
            "hypotheses": [
                one | {"elements": " + ".join(one["elements"]) or "nominal model"}
                for one in found["hypotheses"]
            ],
            "parameters": [{"name": name} | one for name, one in found["parameters"].items()],
            "missing": [
                {"element": one["element"], "name": name} | value
                for one in found["missing"]
                for name, value in one["parameters"].items()
            ],
            "rejections": [
                one | {"hypothesis": " + ".join(one["hypothesis"])} for one in found["rejections"]
            ],
        }

    def show(self, console: "Console") -> None:
        """Print the verdict, names, hypotheses, the remainder and the rejected hypotheses."""
        from rhythmid.diagnose.answer.printed import show

        show(self.diagnosis, console)

    def plot(self, axis: "Axes | None" = None, most: int = 8) -> "Axes":
        """Draw how much worse than the best each hypothesis predicts unseen data, with its standard error and probability.

        Parameters
        ----------
        axis
            Matplotlib axis; a new figure where None.
        most
            Largest number of hypotheses to draw.
        """
        from rhythmid.diagnose.answer.figure import draw_hypotheses

        axis = axis_or_new(axis)
        draw_hypotheses(axis, self.diagnosis, most)
        return axis

    def ledger(self) -> dict[str, Any]:
        """All data that the decision depends on, as plain data; see `replay`."""
        return ledger(self.result.contest, self.result.detectable, self.result.size_errors)


def diagnose(
    records: "Record | JointRecord | Sequence[Record] | Sequence[JointRecord]",
    model: "Model | Machine",
    holdout: "Record | JointRecord | Sequence[Record] | Sequence[JointRecord]" = (),
    catalogue: Catalogue | None = None,
    tell: Tell = lambda _: None,
    budget: float | None = None,
) -> Answer:
    """Find the physics that a nominal model lacks to explain records.

    Parameters
    ----------
    records
        One or more records, to which the models are fitted.
    model
        The nominal model.
    holdout
        Records used for judging only; without any, the last fifth of every record is held out.
    catalogue
        Elements that may be missing; the built-in ones by default.
    tell
        Called with a sentence at the beginning of each step.
    budget
        Wall-clock time [s] in which an answer is due; the answer lists what was not tried for lack of time.

    Returns
    -------
    Answer
        Deterministic for the same records, unless a budget ends the search. A machine of several joints gives a `MachineAnswer`.

    Raises
    ------
    InputError
        For records or models that cannot be judged.

    Examples
    --------
    >>> import rhythmid as rh
    >>> run = {"excitation": {"type": "chirp", "amplitude": 0.3, "sweep": 6.0}, "noise": {"measurement_std": 1e-4}}
    >>> record = rh.simulate(rh.paper_hopper(), run).record
    >>> answer = rh.diagnose(record, rh.paper_hopper())
    >>> answer.diagnosis.verdict
    'consistent'
    """
    fitted = tuple(records) if isinstance(records, Sequence) else (records,)
    judged = tuple(holdout) if isinstance(holdout, Sequence) else (holdout,)
    if not fitted:
        raise InputError("no record is given; name at least one bag or table")
    if not isinstance(model, Model):
        from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine  # needs MuJoCo

        first, second = (cast("tuple[JointRecord, ...]", one) for one in (fitted, judged))
        return cast(Answer, diagnose_machine(first, model, second, catalogue, tell, budget))
    if not all(isinstance(record, Record) for record in (*fitted, *judged)):
        raise InputError(
            "these records are of several joints: give a model with a body:, as Model.load reads it"
        )
    check_held_out(fitted, judged)
    records, holdout = cast(tuple[Record, ...], fitted), cast(tuple[Record, ...], judged)
    model = with_declared(model, (*records, *holdout))
    check_free(model)
    given = admitted(records, holdout, model)
    # the matrices are tall and thin and workers run in parallel: threads inside linear algebra would only slow them down
    with threadpool_limits(1), ThreadPoolExecutor(cores()) as pool:
        known = catalogue or load_catalogue()
        case = Case(model, given.records, given.holdout, known, pool, tell, Budget(budget))
        whole = replace(case, records=given.whole_records, holdout=given.whole_holdout)
        effort = applicable(whole.records, model)
        untried: list[Untried] = []
        warned = _warning(case, untried)
        made: list[Answer] = []
        answers = _answers(case, whole, effort, given, untried)
        while not made or not made[-1].stands:
            try:
                answer = next(answers, None)
            except InputError as error:
                if not made:
                    raise _refused(error, effort) from error
                # the machine could not be followed in this further scoring mode
                untried.append(Untried(ANOTHER, str(error)))
                break
            if answer is None:
                break
            made.append(answer)
        chosen = _chosen(made)
        unscored = effort.applies and all(one.diagnosis.scoring.kind != "effort" for one in made)
        if unscored and chosen.stands:
            if case.budget.spent:
                untried.append(Untried("a comparison with the recorded effort", SPENT))
            else:
                made.append(_also_by_effort(whole, effort, chosen))
        told = contradictions([one is chosen for one in made].index(True), [one.diagnosis for one in made])
        return with_unit_warning(chosen.saying(told, untried), case.nominal, warned)


def _chosen(made: Sequence[Answer]) -> Answer:
    """The first answer that states names.

    Without one, the first answer that is not a "consistent" one from effort scoring. Effort does not show effects during
    rests or in the command path; the motion, scored afterwards, may.
    """
    stands = (one for one in made if one.stands)
    found = ((one.diagnosis.scoring.kind, one.diagnosis.verdict) for one in made)
    telling = (one for one, said in zip(made, found, strict=True) if said != ("effort", "consistent"))
    return next(stands, None) or next(telling, made[0])


def _warning(case: Case, untried: list[Untried]) -> str | None:
    """The warning of `check_plausible`, if any; if there was no time to finish the check, that is added to `untried`."""
    with deadline(case.budget.at(SEARCHED, LEAST_CALIBRATION)):
        try:
            warned = check_plausible(case.nominal, case.records, case.pool)
        except InputError:
            if not time_is_up():
                raise
            warned = None
        if not time_is_up():
            return warned
    untried.append(Untried("units and signs of the channels", SPENT))
    return None


def _refused(error: InputError, effort: Applicability) -> InputError:
    """Error for records that no scoring mode suits: the reasons for the motion and for the effort."""
    if not effort.recorded:
        return error
    return InputError(f"{error}. The recorded effort cannot be scored either: {effort.reason}")


def _answers(
    case: Case, whole: Case, effort: Applicability, given: Admitted, untried: list[Untried]
) -> Iterator[Answer]:
    """Answers of all applicable scoring modes, the most informative first, computed on demand.

    A free run that follows the machine comes first, unless the machine is quasi-static or the effort has more noise than the
    motion; effort follows where the free run leaves open what is missing. Otherwise effort comes first where it is at least as
    large as the inertial force, because it then moves the machine against other forces. Windows come first where the machine
    swings by itself, and where a band with much of the effort cannot be compared by effort. Effort is scored on the `whole` case,
    whose records are not cut. After a first answer no further mode begins once the budget is spent; it is then added to `untried`.
    """
    effort_notes = (*given.whole_notes, *effort.notes)
    driven = effort.applies and effort.effort_share >= DRIVES_IT and not effort.band_left_out

    def late(way: str) -> bool:
        if case.budget.spent:
            untried.append(Untried(way, SPENT))
        return case.budget.spent

    disturbed = effort.noisier or effort.effort_share >= QUASI_STATIC
    first = effort.applies and (disturbed or not (effort.free_run_is_informative or effort.band_left_out))
    if first:
        answer = _by_effort(whole, effort, effort_notes)
        yield answer
        if effort_suffices(answer.diagnosis, disturbed) or late(BY_MOTION):
            return
    series = prepare((*case.records, *case.holdout))
    by_motion = partial(_by_motion, case, series, given.notes, late)
    if first or not effort.applies:
        yield from by_motion(windows=True)
        return
    last = None
    for last in by_motion(windows=False):
        yield last
    if last is not None:
        if last.diagnosis.verdict in UNSETTLED and not late(BY_EFFORT):
            yield _by_effort(whole, effort, effort_notes)
        return
    if driven:
        yield _by_effort(whole, effort, effort_notes)
        if late(BY_MOTION):
            return
    failed = False
    try:
        yield from by_motion(windows=True)
    except InputError as error:
        if not effort.band_left_out:
            raise
        failed = True
        untried.append(Untried(BY_MOTION, str(error)))
    if failed or not (driven or late(BY_EFFORT)):
        yield _by_effort(whole, effort, effort_notes)


def _by_motion(
    case: Case, series: Sequence[Series], notes: Sequence[str], late: Callable[[str], bool], windows: bool
) -> Iterator[Answer]:
    """Answers of free run and, with `windows`, of windows too; `late` says whether a further mode is left out."""
    count = len(case.records)
    ways = settle(case.nominal, series[:count], series[count:], case.catalogue, case.pool, case.tell, windows)
    for number in itertools.count():
        with deadline(case.budget.at(SEARCHED, LEAST_CALIBRATION)):
            scoring = next(ways, None)
        if scoring is None or (number and late(f"scoring {HOW[scoring.kind]}")):
            return
        result = free_run(case, scoring)
        diagnosis = compose(case, result, notes)
        model = without_record_zero(without_free_maps(result.search.fit.model))
        kept = admissible(model, case.nominal, result.search.fit.std)
        told = [note for name, note in kept.moved.items() if name in case.nominal.parameters]
        yield Answer(diagnosis, kept.model, result).saying(told)


def _by_effort(case: Case, effort: Applicability, notes: Sequence[str], most: int = MOST_EFFECTS) -> Answer:
    result = effort_run(case, effort, most)
    model = with_found_delay(result.search.balance, result.chosen, case.nominal)
    return Answer(compose_effort(case, result, notes), model, result)


def _also_by_effort(case: Case, effort: Applicability, chosen: Answer) -> Answer:
    """The answer of effort scoring beside one that was chosen from the motion, with the delays that the motion shows.

    The effort is compared with the motion at one instant, so that a wrong delay of the nominal model would appear as missing physics.
    """
    known = case.nominal.parameters.keys() & chosen.model.parameters.keys() & set(DELAYS)
    nominal = case.nominal.with_values({name: chosen.model.value(name) for name in known})
    return _by_effort(replace(case, nominal=nominal), effort, (), len(chosen.diagnosis.missing))


def with_unit_warning(answer: Answer, nominal: Model, warned: str | None) -> Answer:
    """The answer with a warning about a channel that seems to be in another unit.

    No warning is given if the values are near the given ones once the missing effects are modelled: a wrong unit would
    still shift them.
    """
    if warned is None or shift(nominal, answer.model) < BACK:
        return answer
    return answer.saying([warned])
