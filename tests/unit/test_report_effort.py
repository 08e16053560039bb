"""The report of an answer by effort: recorded effort beside what the models predict, before and after."""

from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE, axis, axis_model
from json_schema import conforming

from rhythmid.diagnose.answer.compose_effort import compose_effort
from rhythmid.diagnose.answer.present import present
from rhythmid.diagnose.answer.present_effort import effort_findings
from rhythmid.diagnose.case import Case
from rhythmid.diagnose.diagnosis import Answer, diagnose
from rhythmid.diagnose.effort.run import EffortResult
from rhythmid.diagnose.verdict import Unexplained
from rhythmid.report.findings import Findings
from rhythmid.report.page import render
from rhythmid.report.run import error_of


@pytest.fixture(scope="module")
def answer() -> Answer:
    few = CATALOGUE.without(
        *[n for n, e in CATALOGUE.items() if e.candidate and n not in ("coulomb_friction", "quadratic_drag")]
    )
    return diagnose([axis()], axis_model(), [axis(1)], few)


@pytest.fixture(scope="module")
def found(answer) -> Findings:
    assert isinstance(answer.result, EffortResult)
    return effort_findings(answer.diagnosis, answer.result, axis_model(), [axis()], [axis(1)])


def test_the_efforts_that_are_drawn_have_the_errors_that_the_answer_states(answer, found):
    fit = answer.diagnosis.fit
    for heldout, names in ((False, "train_nrmse"), (True, "heldout_nrmse")):
        runs = [run for run in found.runs if run.heldout is heldout]
        for which, key in (("before", "refitted_nominal"), ("after", "augmented")):
            error = error_of(runs, which)
            assert error is not None
            assert error.ratio == pytest.approx(getattr(fit[key], names), rel=0.1)


def test_stretches_are_evenly_sampled_and_stuck_samples_do_not_count(found):
    for run in found.runs:
        assert np.ptp(np.diff(run.time)) < 1e-9
        assert 0.5 < run.used.mean() < 1.0
    assert found.compared.quantity == "effort" and found.compared.unit == "N"


def test_what_goes_with_the_speed_is_gone_after(found):
    speed = next(one for one in found.functions if one.quantity == "velocity")
    assert speed.force_after is not None
    assert np.ptp(speed.force_after) < 0.2 * np.ptp(speed.force)


def test_the_remainder_is_the_one_of_the_decision_with_the_curve_over_the_quantity_that_is_named(answer):
    assert isinstance(answer.result, EffortResult)
    for quantity in ("velocity", "further effects that are not established (play)"):
        left = Unexplained(0.07, True, quantity)
        result = replace(answer.result, decision=replace(answer.result.decision, unexplained=left))
        told = compose_effort(Case(axis_model(), [axis()], [axis(1)], CATALOGUE), result, ()).remainder
        assert (told.share, told.goes_with) == (0.07, quantity)
        assert (told.curve is not None) is (quantity == "velocity")


@pytest.mark.parametrize(("verdict", "said"), [("undecided", "not located"), ("consistent", "nowhere")])
def test_an_answer_without_a_name_says_nowhere_only_where_nothing_is_missing(answer, verdict, said):
    result = replace(answer.result, decision=replace(answer.result.decision, verdict=verdict, named=()))
    told = compose_effort(Case(axis_model(), [axis()], [axis(1)], CATALOGUE), result, ())
    assert told.location.where.startswith(said)


def test_the_chosen_hypothesis_is_among_those_that_are_listed(answer):
    listed = [one.elements for one in answer.diagnosis.hypotheses]
    assert answer.diagnosis.chosen == ("coulomb_friction",) and answer.diagnosis.chosen in listed


def test_the_answer_as_json_keeps_to_the_schema(answer):
    assert conforming(answer.diagnosis).scoring.kind == "effort"


def test_the_page_is_made_from_the_answer_alone(answer):
    html = render(present(answer, axis_model(), [axis()], [axis(1)], "rhythmid diagnose bags", "axis.yaml"))
    assert "Missing physics: Coulomb friction" in html
    assert "of the effort" in html and "of the motion" not in html
    assert "What was assumed" in html and "Harmonics of the cycle" not in html
