"""The bench's table: what an answer's JSON comes to, and what counts as right."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from bench_case import COULOMB_FAMILY, Case
from real_recordings import HEADS, judged, mirrored, row_of, saved_rows, table

PLACE = Path("signals.yaml")
FRICTION = Case("axis", "mass", (PLACE, PLACE), (PLACE,), PLACE, COULOMB_FAMILY, {})
NOTHING = Case("axis null", "mass", (PLACE,), (), PLACE, frozenset(), {})


def answer(verdict="missing_physics", names=("coulomb_friction",), before=0.2, after=0.1, **more):
    return {
        "verdict": verdict,
        "missing": [{"element": name, "probability": 0.9} for name in names],
        "fit": {"refitted_nominal": {"heldout_nrmse": before}, "augmented": {"heldout_nrmse": after}},
        **more,
    }


@pytest.mark.parametrize(
    ("case", "found", "right"),
    [
        (FRICTION, answer(), "first"),
        (FRICTION, answer(names=("stribeck_friction", "quadratic_drag")), "first"),
        (FRICTION, answer(names=("quadratic_drag", "coulomb_friction")), "no"),
        (FRICTION, answer("unknown_physics"), "listed"),
        (FRICTION, answer("consistent", names=()), "no"),
        (FRICTION, answer("undecided", names=(), hypotheses=[{"elements": ["coulomb_friction"]}]), "listed"),
        (NOTHING, answer("consistent", names=()), "first"),
        (NOTHING, answer("undecided", names=()), "no"),
    ],
)
def test_right_is_the_accepted_effect_first_and_stated(case, found, right):
    assert row_of(case, found, 1.0).right == right


def test_a_machine_without_an_accepted_answer_is_not_judged():
    case = Case("go2 FL_calf", "servo", (PLACE,), (), PLACE, None, {})
    assert judged(case, answer(), (("coulomb_friction", 0.9),)) == ""


def test_the_share_is_told_or_follows_from_the_errors():
    assert row_of(FRICTION, answer(), 1.0).share == pytest.approx(0.75)
    told = answer()
    told["missing"][0]["share"] = 0.6
    assert row_of(FRICTION, told, 1.0).share == 0.6
    assert row_of(FRICTION, answer(names=()), 1.0).share is None


@pytest.mark.parametrize(
    ("scoring", "kind"),
    [({"kind": "effort", "bandwidth": 5.0}, "effort"), ("free run", "free run"), ("the balance of forces, tied", "the balance of forces")],
)  # fmt: skip
def test_the_kind_of_scoring_is_told_in_a_word_or_two(scoring, kind):
    assert row_of(FRICTION, answer(scoring=scoring), 1.0).scoring == kind


def test_known_parameters_that_were_found_are_compared():
    case = Case(
        "axis",
        "mass",
        (PLACE,),
        (),
        PLACE,
        COULOMB_FAMILY,
        {"inertia.mass": 2.0, "coulomb_friction.force": 1.0},
    )
    found = answer(parameters={"inertia.mass": {"value": 2.2}})
    assert row_of(case, found, 1.0).off == pytest.approx(0.1)
    assert row_of(case, answer(), 1.0).off is None


def test_a_case_that_fails_has_a_row_with_the_reason():
    row = row_of(FRICTION, None, 3.0, "exit 2: too short")
    assert row.verdict == "exit 2: too short" and row.right == "no"
    assert "exit 2: too short" in table([row])


def test_the_table_has_one_line_a_case_in_both_forms():
    rows = [row_of(FRICTION, answer(), 1.0), row_of(NOTHING, answer("consistent", names=()), 1.0)]
    assert len(table(rows).splitlines()) == 3
    lines = table(rows, markdown=True).splitlines()
    assert len(lines) == 4 and all(line.count("|") == len(HEADS) + 1 for line in lines)
    assert "20 → 10" in lines[2]


def test_left_and_right_are_compared_by_the_families_of_their_dominant_names():
    def joint(name: str, *names: str):
        return row_of(Case(f"go2 {name}", "servo", (PLACE,), (), PLACE, None, {}), answer(names=names), 1.0)

    (same,) = mirrored([joint("FL_calf", "coulomb_friction"), joint("FR_calf", "stribeck_friction")])
    assert "agree" in same
    (other,) = mirrored([joint("RL_hip", "coulomb_friction"), joint("RR_hip", "sensor_lag")])
    assert "differ" in other


def test_rows_of_earlier_runs_are_read_back_and_the_last_counts(tmp_path):
    first, second = row_of(FRICTION, answer(), 1.0), row_of(FRICTION, answer("undecided"), 2.0)
    for name, row in (("a.json", first), ("b.json", second)):
        (tmp_path / name).write_text(json.dumps([asdict(row)]))
    assert saved_rows([tmp_path / "a.json", tmp_path / "b.json"]) == [second]
