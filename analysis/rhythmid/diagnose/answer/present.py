"""Convert a diagnosis' answer into the plain data that its report draws."""

from collections.abc import Sequence
from dataclasses import asdict, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi2_distribution

from rhythmid.compare.compare import Comparison, run_of
from rhythmid.diagnose.answer.compose import estimated
from rhythmid.diagnose.answer.described import described, labels_of
from rhythmid.diagnose.answer.present_effort import effort_findings
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.delays import delays_of
from rhythmid.diagnose.diagnosis import Answer
from rhythmid.diagnose.free_run import FreeRunResult
from rhythmid.diagnose.location import Dependence
from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.round import LEVEL
from rhythmid.elements.element import Element
from rhythmid.errors import InputError
from rhythmid.identify.admissible import admissible
from rhythmid.identify.motion_band import bandwidth
from rhythmid.identify.output_error import Fit, noise_of
from rhythmid.identify.repeats import noise_from_repeats
from rhythmid.identify.series import Series
from rhythmid.identify.shown_runs import free_runs
from rhythmid.ltp.htf import theoretical_htf
from rhythmid.ltp.pumping import Pumping, active_pumping
from rhythmid.model import Model
from rhythmid.record.record import Record
from rhythmid.report.comparison import comparison_page, comparison_section
from rhythmid.report.correlation import Correlation
from rhythmid.report.diagnosis import diagnosis_page
from rhythmid.report.findings import ElementScore, Findings, FreeFunction, TransferChange
from rhythmid.report.page import Page
from rhythmid.report.record_quality import quality_of
from rhythmid.report.run import Compared, Run

Array = NDArray[np.float64]
INDICES = (0, -1, 1, -2, 2)  # indices of the harmonic transfer functions that are compared
RARE = 0.02  # share of the motion's samples at either end where a free function is poorly determined
POINTS = 240  # points of a transfer function


def present(
    answer: Answer,
    nominal: Model,
    records: Sequence[Record],
    holdout: Sequence[Record] = (),
    command: str = "",
    name: str = "the nominal model",
    comparison: Comparison | None = None,
) -> Page:
    """The report of an answer.

    `nominal`, `records` and `holdout` are the arguments that `diagnose` was given; `command` is the command line; `name`
    is the nominal model's name. A `comparison` with a simulation is put first.
    """
    result = answer.result
    if isinstance(result, FreeRunResult):
        found = findings(answer.diagnosis, result, nominal, records, holdout, command, name)
    else:
        found = effort_findings(answer.diagnosis, result, nominal, records, holdout, command, name)
    page = diagnosis_page(found)
    if comparison is None:
        return page
    section = comparison_section(comparison.to_dict(), run_of(comparison), comparison.unit)
    return replace(page, sections=(section, *page.sections))


def present_comparison(
    found: Comparison, simulation: Record, records: Sequence[Record], command: str = ""
) -> Page:
    """The report of a comparison without a model; `simulation` and `records` are the arguments of `compare`."""
    quality = [quality_of(simulation, "simulation"), *(quality_of(one, "recording") for one in records)]
    return comparison_page(found.to_dict(), run_of(found), found.unit, quality, command)


def findings(
    diagnosis: Diagnosis,
    result: FreeRunResult,
    nominal: Model,
    records: Sequence[Record],
    holdout: Sequence[Record] = (),
    command: str = "",
    name: str = "the nominal model",
) -> Findings:
    """The content of the report for free-run or window scoring, as plain data; arguments as for `present`."""
    found = result.search
    pumpings = {id(record): active_pumping(record) for record in (*records, *holdout)}
    chosen = result.selection.chosen
    labels = labels_of(chosen.kind)
    seen = {record.name: pumpings[id(record)] for record in records}
    added = bool(found.best.added)
    runs = free_runs(found.nominal, found.fit, seen, added, labels)
    if result.unseen_nominal is not None:
        after = result.unseen_augmented or result.unseen_nominal
        repaired = added and result.unseen_augmented is not None
        unseen = {record.name: pumpings[id(record)] for record in holdout}
        runs += free_runs(result.unseen_nominal, after, unseen, repaired, labels, heldout=True)
    models = {"Nominal model": nominal.to_yaml(), "Nominal model, refitted": found.nominal.model.to_yaml()}
    if added:
        models["Augmented model"] = admissible(found.fit.model, nominal).model.to_yaml()
    count = max(len(found.rounds[0].scores), 1)
    repeats = noise_from_repeats(found.fit.run.series)
    return Findings(
        **described(diagnosis, chosen, nominal, records, holdout, _elements(found, nominal), command, name),
        forced=any(one.forcing is not None for one in result.calibration.series),
        compared=Compared("motion", nominal.units.position),
        runs=tuple(runs),
        force_unit=nominal.units.force,
        noise=repeats.variance**0.5 if repeats else None,
        slow_noise=(repeats or noise_of(found.fit.residuals, found.fit.run.series)).long_run_variance ** 0.5,
        scores=_scores(found),
        threshold=float(chi2_distribution.isf(LEVEL / count, 1)),
        functions=_functions(result.before, result.after if added else (), runs, nominal),
        transfer=_transfer(
            found, [p for r in records if (p := pumpings[id(r)])], result.calibration.series, nominal
        ),
        refitted={name: asdict(estimated(found.nominal, name)) for name in found.nominal.model.parameters},
        refitted_delays=delays_of(found.nominal),
        models=models,
        at_bound=found.fit.at_bound,
        unconverged=tuple(trial.names for trial in found.trials if not trial.converged),
        correlation=_correlation(found.fit),
    )


def _correlation(fit: Fit) -> Correlation | None:
    """Correlation of the fitted parameters; None for a single one."""
    return Correlation(fit.names, fit.joint_covariance.correlation) if len(fit.names) > 1 else None


def _scores(found: Search) -> tuple[ElementScore, ...]:
    """The best score of each element in the first round, best first."""
    best: dict[str, ElementScore] = {}
    for score in found.rounds[0].scores:
        best.setdefault(
            score.element.name, ElementScore(score.element.name, score.element.slot, score.statistic)
        )
    return tuple(best.values())


def _functions(
    before: Sequence[Dependence], after: Sequence[Dependence], runs: Sequence[Run], model: Model
) -> tuple[FreeFunction, ...]:
    later = {one.quantity: one for one in after}
    paths = {"position": [run.position for run in runs], "velocity": [run.velocity for run in runs]}

    def shape(one: Dependence) -> tuple[Array, Array]:
        """The well-determined part of the curve, without what the model's own parameters can absorb.

        These absorb an offset, and over position or speed also a slope.
        """
        if not len(one.force):
            return one.grid, one.force
        known = np.arange(len(one.grid)) < len(one.grid) - 1  # the splines end before the last point
        moved = one.quantity in paths
        if moved:
            low, high = np.quantile(np.concatenate(paths[one.quantity]), [RARE, 1.0 - RARE])
            known &= (one.grid >= low) & (one.grid <= high)
        if known.sum() < 8:
            return one.grid[:0], one.force[:0]
        grid, force = one.grid[known], one.force[known]
        return grid, force - np.polyval(np.polyfit(grid, force, 1 if moved else 0), grid)

    units = {"velocity": f"{model.units.position}/s", "time": "s", "actuator force": model.units.force}
    made = []
    for one in before:
        other = later.get(one.quantity)
        grid, force = shape(one)
        grid_after, force_after = shape(other) if other else (None, None)
        made.append(
            FreeFunction(
                one.quantity, one.explained, grid, force,
                grid_unit=units.get(one.quantity, model.units.position),
                force_unit=model.units.position if "sensor" in one.quantity else model.units.force,
                explained_after=other.explained if other else None,
                grid_after=grid_after,
                force_after=force_after,
            )
        )  # fmt: skip
    return tuple(made)


def _transfer(
    found: Search, pumpings: Sequence[Pumping], series: Sequence[Series], nominal: Model
) -> TransferChange | str:
    """Transfer functions of the refitted nominal and the final model, or the reason why there are none.

    They are linearised around the cycle of the first forced record, or around rest where no forcing was recorded.
    """
    if any(one.kind != "force" for one in series):
        return "transfer functions are stated for a force as input, and these records have another"
    if not pumpings and all(one.command is None for one in series):
        return (
            "these records have neither an input nor a forcing, so there are no transfer functions to compare"
        )
    highest = max(bandwidth(one.value, one.period) for one in series)
    if pumpings:
        pumping, indices = pumpings[0], np.array(INDICES)
        highest = min(highest, 20.0 * pumping.frequency)
    else:
        pumping, indices = Pumping(1.0, np.zeros(2, dtype=complex)), np.array([0])
    frequency = np.linspace(0.02, 1.0, POINTS) * highest
    try:
        before = theoretical_htf(found.nominal.model, pumping, indices, frequency)
        after = theoretical_htf(found.fit.model, pumping, indices, frequency)
    except (InputError, np.linalg.LinAlgError) as error:
        return f"no transfer functions: {error}"
    unit = f"{nominal.units.position}/{nominal.units.force}"
    pumped = pumping.frequency if pumpings else None
    return TransferChange(frequency, tuple(map(int, indices)), before.value, after.value, unit, pumped)


def _elements(found: Search, nominal: Model) -> list[Element]:
    """The elements that a report may mention."""
    elements = [term.element for term in nominal.terms]
    elements += [score.element for score in found.rounds[0].scores]
    return elements + [term.element for trial in found.trials for term in trial.model.terms]
