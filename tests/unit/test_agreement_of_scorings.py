"""Ways to score the same records that apply: where they come to other verdicts or names the answer says so, and else it does not."""

from types import SimpleNamespace

import pytest
from answers import diagnosed

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.deadline import SPENT
from rhythmid.diagnose import diagnosis as module
from rhythmid.diagnose.agreement import DOUBTED
from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.case import Untried
from rhythmid.diagnose.diagnosis import ANOTHER, Answer, diagnose
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.transport import INPUT_DELAY

RECORD = records(hopper(), SHORT[2:])
FRICTION = diagnosed("missing_physics", "coulomb_friction")
QUIET = diagnosed("consistent")


def answered(
    monkeypatch: pytest.MonkeyPatch,
    *made: Diagnosis,
    by_effort: Diagnosis | None = None,
    budget: float | None = None,
) -> tuple[Diagnosis, list[int]]:
    """What a user reads of answers that are `made` one after the other, where effort is scored only to compare; and how many effects
    were looked for in the effort."""
    asked: list[int] = []

    def answer(found: Diagnosis) -> Answer:
        return Answer(found, hopper(), SimpleNamespace())  # type: ignore[arg-type]

    def effort(_case, _applicability, _notes, most: int) -> Answer:
        asked.append(most)
        assert by_effort is not None
        return answer(by_effort)

    applies = by_effort is not None or any(one.scoring.kind == "effort" for one in made)
    monkeypatch.setattr(module, "applicable", lambda *_: SimpleNamespace(applies=applies))
    monkeypatch.setattr(module, "_answers", lambda *_: iter([answer(one) for one in made]))
    monkeypatch.setattr(module, "_by_effort", effort)
    return diagnose(RECORD, hopper(), catalogue=CATALOGUE, budget=budget).diagnosis, asked


def test_another_name_by_effort_is_told_with_a_warning(monkeypatch):
    other = diagnosed("missing_physics", "actuator_lag", "backlash", kind="effort")
    found, asked = answered(monkeypatch, FRICTION, by_effort=other)
    (note,) = found.notes
    assert (
        note
        == f"Scored by effort the same records stand by another name: actuator lag and backlash. {DOUBTED}"
    )
    assert found.verdict == "missing_physics" and asked == [1]


def test_a_name_that_both_stand_by_needs_no_note_and_as_many_effects_are_looked_for_in_the_effort(
    monkeypatch,
):
    first = diagnosed("missing_physics", "coulomb_friction", "second_mode")
    found, asked = answered(
        monkeypatch, first, by_effort=diagnosed("missing_physics", "coulomb_friction", kind="effort")
    )
    assert found == first and asked == [2]


@pytest.mark.parametrize(
    ("slot", "told"), [("force", True), ("actuator", True), ("sensor", False), ("timing", False)]
)
def test_nothing_by_effort_speaks_against_what_the_effort_would_show_and_not_against_a_sensor(
    monkeypatch, slot, told
):
    first = diagnosed("missing_physics", "lag", slot=slot)
    found, _ = answered(monkeypatch, first, by_effort=diagnosed("consistent", kind="effort"))
    assert found.notes == (
        (f"Scored by effort the same records lack nothing of practical size. {DOUBTED}",) if told else ()
    )


def test_effort_that_came_first_and_found_nothing_is_told_beside_the_names_that_windows_found(monkeypatch):
    named = diagnosed("missing_physics", "coulomb_friction", kind="windows")
    found, asked = answered(monkeypatch, diagnosed("consistent", kind="effort"), named)
    assert [effect.element for effect in found.missing] == ["coulomb_friction"] and asked == []
    assert found.notes == (f"Scored by effort the same records lack nothing of practical size. {DOUBTED}",)


def test_every_other_verdict_is_told_with_what_it_says(monkeypatch):
    found, _ = answered(
        monkeypatch, diagnosed("unknown_physics", kind="windows"), diagnosed("undecided", kind="free_run"),
        diagnosed("unknown_physics", kind="effort"),
    )  # fmt: skip
    assert found.verdict == "unknown_physics"
    assert found.notes == (
        "Scored in free run the same records come to another verdict. The verdict is undecided.",
    )


@pytest.mark.parametrize("verdict", ["undecided", "unknown_physics"])
def test_effort_that_names_nothing_does_not_contradict_a_name_from_a_free_run(monkeypatch, verdict):
    found, asked = answered(monkeypatch, FRICTION, by_effort=diagnosed(verdict, kind="effort"))
    assert found == FRICTION and asked == [1]


def test_effort_that_comes_first_and_knows_no_name_contradicts_one_from_windows(monkeypatch):
    named = diagnosed("missing_physics", "coulomb_friction", kind="windows")
    found, _ = answered(monkeypatch, diagnosed("unknown_physics", kind="effort"), named)
    (note,) = found.notes
    assert note.startswith("Scored by effort the same records come to another verdict.")


def test_effort_is_compared_at_the_delays_that_the_motion_shows(monkeypatch):
    asked: list[Model] = []
    late = hopper().with_values({INPUT_DELAY: 0.04})

    def effort(case, *_):
        asked.append(case.nominal)
        return Answer(FRICTION, case.nominal, SimpleNamespace())  # type: ignore[arg-type]

    monkeypatch.setattr(module, "applicable", lambda *_: SimpleNamespace(applies=True))
    monkeypatch.setattr(module, "_answers", lambda *_: iter([Answer(FRICTION, late, SimpleNamespace())]))
    monkeypatch.setattr(module, "_by_effort", effort)
    diagnose(RECORD, hopper(), catalogue=CATALOGUE)
    (nominal,) = asked
    assert nominal.value(INPUT_DELAY) == 0.04
    assert nominal.mass == hopper().mass


@pytest.mark.parametrize("verdict", ["undecided", "unknown_physics", "consistent", "missing_physics"])
def test_effort_is_asked_where_a_free_run_leaves_open_what_is_missing(monkeypatch, verdict):
    asked: list[str] = []

    def answer(found: Diagnosis) -> Answer:
        return Answer(found, hopper(), SimpleNamespace())  # type: ignore[arg-type]

    def effort(*_):
        asked.append("effort")
        return answer(diagnosed("missing_physics", "coulomb_friction", kind="effort"))

    def motion(*_, windows: bool):
        assert not windows
        yield answer(diagnosed(verdict, "second_mode"))

    able = SimpleNamespace(
        applies=True,
        effort_share=0.5,
        free_run_is_informative=True,
        band_left_out=False,
        noisier=False,
        notes=(),
    )
    monkeypatch.setattr(module, "applicable", lambda *_: able)
    monkeypatch.setattr(module, "_by_motion", motion)
    monkeypatch.setattr(module, "_by_effort", effort)
    found = diagnose(RECORD, hopper(), catalogue=CATALOGUE).diagnosis
    open_end = verdict in ("undecided", "unknown_physics")
    assert (found.scoring.kind == "effort") == open_end
    assert bool(asked) == (verdict != "consistent")  # beside stated names it is compared


def test_one_way_to_score_is_compared_with_nothing(monkeypatch):
    assert answered(monkeypatch, FRICTION) == (FRICTION, [])
    assert answered(monkeypatch, QUIET, by_effort=FRICTION) == (QUIET, [])


def test_another_way_to_score_that_cannot_follow_the_machine_is_told_with_the_reason(monkeypatch):
    def answers(*_):
        yield Answer(diagnosed("undecided", kind="effort"), hopper(), SimpleNamespace())  # type: ignore[arg-type]
        raise InputError("the model diverges")

    monkeypatch.setattr(module, "applicable", lambda *_: SimpleNamespace(applies=True))
    monkeypatch.setattr(module, "_answers", answers)
    found = diagnose(RECORD, hopper(), catalogue=CATALOGUE).diagnosis
    assert found.verdict == "undecided"
    assert found.excluded == (Untried(ANOTHER, "the model diverges"),)


def test_where_neither_motion_nor_effort_can_be_scored_both_reasons_are_told(monkeypatch):
    def answers(*_):
        raise InputError("the model diverges")
        yield

    refused = SimpleNamespace(applies=False, recorded=True, reason="no map explains it")
    monkeypatch.setattr(module, "applicable", lambda *_: refused)
    monkeypatch.setattr(module, "_answers", answers)
    with pytest.raises(InputError, match=r"diverges\. The recorded effort .* no map explains it"):
        diagnose(RECORD, hopper(), catalogue=CATALOGUE)


def test_a_warning_of_units_for_which_there_was_no_time_is_no_reason_to_refuse(monkeypatch):
    def refused(*_):
        raise InputError("the input seems to be in mm")

    monkeypatch.setattr(module, "check_plausible", refused)
    monkeypatch.setattr(module, "time_is_up", lambda: True)
    found, _ = answered(monkeypatch, FRICTION)
    assert found.excluded == (Untried("units and signs of the channels", SPENT),)
    monkeypatch.setattr(module, "time_is_up", lambda: False)
    with pytest.raises(InputError, match="in mm"):
        answered(monkeypatch, FRICTION)


def test_a_comparison_for_which_there_is_no_time_is_told(monkeypatch):
    found, asked = answered(monkeypatch, FRICTION, by_effort=FRICTION, budget=0.0)
    assert asked == [] and found.notes == ()
    assert found.excluded == (Untried("a comparison with the recorded effort", SPENT),)


def test_a_mismatch_that_another_way_finds_outranks_an_effort_that_shows_none(monkeypatch):
    found, _ = answered(monkeypatch, diagnosed("consistent", kind="effort"), diagnosed("unknown_physics"))
    assert found.verdict == "unknown_physics"
    (note,) = found.notes
    assert note.startswith("Scored by effort the same records come to another verdict.")
