"""A budget of time: whatever it cuts off is told, by motion and by effort, and nothing where there is time enough."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import chain, repeat

import pytest
from axes import CATALOGUE as EVERYTHING
from axes import axis, axis_model

from machines import CATALOGUE, SHORT, hopper, only, records
from rhythmid.deadline import SPENT, deadline
from rhythmid.diagnose import free_run as search_of_motion
from rhythmid.diagnose.answer.compose import MORE_TIME
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.case import EXPLAINED, Budget
from rhythmid.diagnose.contenders import contend, rows_of
from rhythmid.diagnose.diagnosis import BY_EFFORT, diagnose
from rhythmid.diagnose.effort import search
from rhythmid.diagnose.hypothesis import Kind
from rhythmid.diagnose.search.trial import Trial
from rhythmid.identify.descent import WHITE
from rhythmid.identify.output_error import start_only
from rhythmid.identify.series import prepare
from rhythmid.record.record import Record

FEW = ("coulomb_friction", "cubic_stiffness", "quadratic_drag")
FRICTION = {"force": 0.02, "transition": 0.002}


def cut_off(found: Diagnosis) -> list[str]:
    """What was not tried for want of time."""
    return [one.name for one in found.excluded if one.reason == SPENT]


def spent(monkeypatch: pytest.MonkeyPatch, *answers: bool) -> None:
    """Whether a budget is spent, asked again and again; the last answer stands."""
    asked: Iterator[bool] = chain(answers, repeat(answers[-1]))
    monkeypatch.setattr(Budget, "spent", property(lambda _: next(asked)))


@cache
def runs() -> list[Record]:
    whole = records(hopper().with_element(CATALOGUE["coulomb_friction"], FRICTION), SHORT[:2])
    return [one.cut(2.0, 8.0) for one in whole]


def by_motion() -> Diagnosis:
    return diagnose(runs(), hopper(), catalogue=only(*FEW)).diagnosis


def by_effort() -> Diagnosis:
    known = EVERYTHING.without(*(name for name in EVERYTHING if name not in (*FEW, "viscous_damper")))
    return diagnose([axis(length=10.0)], axis_model(), catalogue=known).diagnosis


def test_by_motion_a_budget_that_is_spent_at_once_tells_elements_and_other_explanations(monkeypatch):
    spent(monkeypatch, True)
    *elements, others, effort = cut_off(by_motion())
    assert "coulomb_friction" in elements and "freed values" in others and effort == BY_EFFORT


@pytest.mark.parametrize("scored", ["by_motion", "by_effort"])
def test_a_search_that_a_budget_ends_calls_nothing_unknown_that_it_did_not_try(monkeypatch, scored):
    spent(monkeypatch, True)
    found = by_motion() if scored == "by_motion" else by_effort()
    assert found.verdict == "undecided" and found.summary.startswith("The budget ended the search")


def test_by_motion_a_budget_that_is_spent_after_an_effect_tells_that_it_was_not_tried_without(monkeypatch):
    spent(monkeypatch, False, True)
    found = by_motion()
    assert found.missing[0].element == "coulomb_friction"
    assert "backward elimination" in cut_off(found)


def test_by_motion_a_time_that_is_over_tells_what_could_not_be_tried_and_names_nothing(monkeypatch):
    calibrated = Budget(0.0, began=-1e9)
    monkeypatch.setattr(Budget, "at", lambda self, share, least=0.0: math.inf if least else calibrated.began)
    monkeypatch.setattr(Budget, "spent", False)
    found = by_motion()
    assert found.verdict == "undecided" and not found.missing
    told = " ".join(cut_off(found))
    assert all(
        one in told for one in ("coulomb_friction", "freed values", "convergence of the nominal model")
    )


def test_by_effort_a_time_that_is_over_tells_the_candidates_that_were_not_fitted(monkeypatch):
    monkeypatch.setattr(search, "time_is_up", lambda: True)
    found = by_effort()
    assert found.verdict == "undecided" and not found.missing
    assert "coulomb_friction" in cut_off(found)


def test_by_effort_a_budget_that_is_spent_at_once_tells_all_candidates(monkeypatch):
    spent(monkeypatch, True)
    found = by_effort()
    assert found.scoring.kind == "effort" and not found.missing
    assert {"coulomb_friction", "quadratic_drag", "input_delay.delay"} <= set(cut_off(found))


def test_by_effort_a_budget_that_is_spent_after_an_effect_tells_that_no_further_one_was_tried(monkeypatch):
    spent(monkeypatch, False, True)
    found = by_effort()
    assert [effect.element for effect in found.missing] == ["coulomb_friction"]
    assert cut_off(found) == ["further effects beside coulomb_friction"]


@pytest.mark.parametrize("scored", [by_motion, by_effort])
def test_with_time_enough_nothing_is_cut_off(scored):
    assert cut_off(scored()) == []


def test_by_motion_a_time_that_is_over_after_the_search_weighs_what_a_verdict_needs_and_tells_the_rest(
    monkeypatch,
):
    searched = search_of_motion.search

    def all_time_gone(*given, **named):
        found = searched(*given, **named)
        monkeypatch.setattr(Budget, "at", lambda self, share, least=0.0: -math.inf)
        return found

    monkeypatch.setattr(search_of_motion, "search", all_time_gone)
    found = by_motion()
    assert [effect.element for effect in found.missing] == ["coulomb_friction"]
    told = " ".join(cut_off(found))
    for one in ("freed values", "mismatch of the nominal model", "small effects"):
        assert one in told
    assert found.next_experiment == MORE_TIME
    assert found.verdict == "undecided" and "freed values" in found.summary
    assert {one.elements for one in found.hypotheses} >= {(), ("coulomb_friction",)}


def test_once_time_is_up_only_the_best_model_of_each_number_of_effects_is_weighed():
    series = prepare(records(hopper(), SHORT[:1]))
    fit = start_only(hopper(), series, WHITE, 1e-3)
    begun = Trial((), hopper(), fit.starts, fit.chi2, fit.samples, len(hopper().free), True, WHITE)
    trials: list[tuple[Trial, Kind]] = [(begun, "nominal")]
    for place, (name, values) in enumerate(
        {"coulomb_friction": FRICTION, "cubic_stiffness": {"coefficient": 1.0}}.items()
    ):
        model = hopper().with_element(CATALOGUE[name], values)
        trials.append((replace(begun, added=(name,), model=model, chi2=1.0 + place), "effects"))
    with deadline(-math.inf):
        made = contend(trials, series, rows_of(series, (), WHITE), 1e-3)
    assert [one.trial.added for one in made] == [(), ("coulomb_friction",)]


def test_what_would_end_after_its_share_of_a_budget_is_not_begun(monkeypatch):
    monkeypatch.setattr(Budget, "allows", lambda self, seconds, share: False)
    monkeypatch.setattr(Budget, "passed", lambda self, share: share >= EXPLAINED)
    found = by_motion()
    assert found.missing[0].element == "coulomb_friction"
    assert {search_of_motion.BEFORE, search_of_motion.INTERVALS} <= set(cut_off(found))
