"""Answers held against opened truths, and the card made of the scores."""

import math
from dataclasses import asdict, replace

import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.output import write_json
from rhythmid.proof.campaign import read_score
from rhythmid.proof.card import confusion, coverage, markdown, summary
from rhythmid.proof.rate import Rate, rate
from rhythmid.proof.reliability import EDGES, reliability
from rhythmid.proof.score import Estimated, score

CATALOGUE = load_catalogue()


def truth(*names: str, ratio: float = 1.0, clutter: tuple[str, ...] = (), **more) -> dict:
    concealed = [{"effect": {"name": name, "parameters": {"force": 0.1}}, "ratio": ratio} for name in names]
    small = [
        {"effect": {"name": name, "parameters": {"force": 0.01}}, "ratio": 0.05 * ratio} for name in clutter
    ]
    return {
        "name": "single-0000", "kind": "single", "concealed": concealed, "ratio": ratio, "noise": {"kind": "white"},
        "nominal_error": 0.1, "floors": {"5": 0.01}, "absent": [],
        "parameters": {"linear_spring.stiffness": 200.0, "input_delay.delay": 0.02}, "design": "hopper",
        "cluttered": bool(clutter), "clutter": small,
    } | more  # fmt: skip


def answer(
    verdict: str, *names: str, families=(), value: float = 0.1, std: float = 0.01, heldout: float = 0.0105,
    probability: float = 0.9, scoring: str = "free_run",
) -> dict:  # fmt: skip
    missing = [
        {
            "element": name,
            "slot": CATALOGUE[name].slot,
            "probability": probability,
            "parameters": {"force": {"value": value, "std": std, "unit": "N"}},
        }
        for name in names
    ]
    return {
        "verdict": verdict, "missing": missing, "indistinguishable": [list(group) for group in families], "block": 5,
        "location": {"slot": missing[0]["slot"] if missing else None}, "fit": {"augmented": {"heldout_nrmse": heldout}},
        "parameters": {"linear_spring.stiffness": {"value": 201.0, "std": 1.0, "unit": "N/m"}},
        "seconds": 10.0, "processor_seconds": 15.0, "scoring": {"kind": scoring},
    }  # fmt: skip


def judged(true: dict, said: dict):
    return score(true, said, CATALOGUE)


def test_the_very_name_is_exact():
    one = judged(truth("coulomb_friction"), answer("missing_physics", "coulomb_friction"))
    assert one.outcome == "exact" and one.slot_right and one.right_within_family
    assert one.heldout == pytest.approx(1.05)


def test_another_name_is_wrong_though_the_slot_be_right():
    one = judged(truth("coulomb_friction"), answer("missing_physics", "stribeck_friction"))
    assert one.outcome == "wrong" and one.slot_right and not one.right_within_family


def test_one_name_too_many_is_wrong():
    said = answer("missing_physics", "coulomb_friction", "backlash")
    assert judged(truth("coulomb_friction"), said).outcome == "wrong"


def test_a_declared_family_of_two_holds_the_name():
    said = answer("missing_physics", "delay_drift", families=[("delay_drift", "clock_skew")])
    assert judged(truth("clock_skew"), said).outcome == "family"


def test_a_law_that_was_moved_to_a_place_stands_for_the_element_that_the_place_has():
    said = answer("missing_physics", "actuator_lag")
    (missing,) = said["missing"]
    missing["element"] = "sensor_lag_of_the_actuator"
    lag = judged(truth("actuator_lag", kind="left-out", absent=["actuator_lag"]), said)
    assert lag.outcome == "family" and lag.stated_wrong == () and lag.dominant_first
    for other in ("command_lag", "actuator_saturation", "viscoelastic_relaxation"):
        assert judged(truth(other), said).stated_wrong == ("sensor_lag_of_the_actuator",)


def test_a_family_of_three_is_no_answer():
    group = ("delay_drift", "clock_skew", "backlash")
    assert (
        judged(truth("clock_skew"), answer("missing_physics", "delay_drift", families=[group])).outcome
        == "wrong"
    )


@pytest.mark.parametrize(
    ("verdict", "outcome"),
    [("unknown_physics", "unknown"), ("undecided", "undecided"), ("consistent", "consistent")],
)
def test_a_name_counts_only_under_the_verdict_that_physics_is_missing(verdict, outcome):
    assert judged(truth("coulomb_friction"), answer(verdict, "coulomb_friction")).outcome == outcome


@pytest.mark.parametrize(
    ("design", "group", "outcome"),
    [
        ("motor", ("command_lag", "actuator_lag", "sensor_lag"), "family"),
        ("motor", ("actuator_lag", "command_hold"), "undecided"),
        ("motor", ("command_lag", "sensor_lag"), "undecided"),
        ("hopper", ("command_lag", "actuator_lag", "sensor_lag"), "undecided"),
    ],
)
def test_what_no_record_of_a_machine_tells_apart_need_not_be_decided(design, group, outcome):
    said = answer("undecided", group[0], families=[group])
    assert judged(truth("actuator_lag", design=design), said).outcome == outcome


def test_two_forms_of_one_law_need_not_be_decided():
    said = answer("undecided", "clock_skew", families=[("clock_skew", "delay_drift")])
    assert judged(truth("delay_drift"), said).outcome == "family"
    assert judged(truth("clock_skew", "backlash"), said).outcome == "undecided"


def test_pairs_need_both_names_and_both_slots():
    both = truth("coulomb_friction", "backlash", kind="pairs")
    assert judged(both, answer("missing_physics", "backlash", "coulomb_friction")).outcome == "exact"
    half = judged(both, answer("missing_physics", "backlash"))
    assert half.outcome == "wrong" and not half.slot_right


@pytest.mark.parametrize(
    ("design", "laws", "probability", "outcome"),
    [
        ("motor", ("actuator_lag", "command_lag", "sensor_lag"), 0.95, "family"),
        ("motor", ("actuator_lag", "command_lag", "sensor_lag"), 0.7, "wrong"),
        ("motor", ("command_lag", "sensor_lag"), 0.95, "wrong"),
        ("motor", ("actuator_lag", "command_hold"), 0.95, "wrong"),
        ("hopper", ("actuator_lag", "command_lag", "sensor_lag"), 0.95, "wrong"),
    ],
)
def test_of_a_pair_the_family_is_enough_where_no_record_of_the_machine_tells_its_laws_apart(
    design, laws, probability, outcome
):
    both = truth("constant_force", "actuator_lag", kind="pairs", design=design)
    lag = {"family": "lag", "laws": list(laws), "share": 0.1, "probability": probability}
    assert judged(both, answer("missing_physics", "constant_force") | {"families": [lag]}).outcome == outcome


def test_a_diagnosis_that_fails_is_scored_as_failed():
    failed = {"failure": "refused: no", "seconds": 1.0, "processor_seconds": 1.0}
    assert judged(truth("backlash"), failed).outcome == "failed"


def test_nothing_concealed_and_something_claimed_is_a_false_alarm():
    nothing = truth(kind="null")
    assert judged(nothing, answer("missing_physics", "backlash")).false_alarm
    assert judged(nothing, answer("unknown_physics")).false_alarm
    assert not judged(nothing, answer("consistent")).false_alarm


def test_a_left_out_effect_must_not_get_a_confident_name():
    left_out = truth("coulomb_friction", kind="left-out")
    assert judged(left_out, answer("unknown_physics", "backlash")).honest
    assert not judged(left_out, answer("missing_physics", "backlash")).honest
    declared = answer("missing_physics", "backlash", families=[("backlash", "actuator_deadband")])
    assert judged(left_out, declared).honest
    assert not judged(left_out, answer("consistent")).honest


def test_deviations_are_in_standard_deviations_and_angles_wrap():
    assert Estimated("a.force", 1.0, 1.2, 0.1).deviation == pytest.approx(2.0)
    assert Estimated("a.phase", 3.1, 3.2 - 2 * math.pi, 0.1).deviation == pytest.approx(1.0)


def test_only_parameters_of_an_exact_name_are_held_against_their_intervals():
    one = judged(truth("coulomb_friction"), answer("missing_physics", "coulomb_friction", value=0.13))
    assert [e.name for e in one.effects] == ["coulomb_friction.force"]
    assert coverage(one.effects).hits == 0
    assert coverage(one.machine).hits == 1
    assert judged(truth("coulomb_friction"), answer("missing_physics", "backlash")).effects == ()


def test_a_special_case_that_is_declared_indistinguishable_from_the_truth_is_no_fault():
    said = answer("missing_physics", "coulomb_friction")
    friction = ["coulomb_friction", "stribeck_friction", "backlash"]
    assert judged(truth("stribeck_friction"), said | {"indistinguishable": [friction]}).outcome == "family"
    assert judged(truth("backlash"), said | {"indistinguishable": [friction]}).outcome == "wrong"
    assert judged(truth("stribeck_friction"), said).outcome == "wrong"


def test_clutter_that_is_named_beside_the_concealed_effect_is_no_fault():
    true = truth("coulomb_friction", clutter=("quadratic_drag", "magnet"))
    assert judged(true, answer("missing_physics", "coulomb_friction")).outcome == "exact"
    both = judged(true, answer("missing_physics", "coulomb_friction", "quadratic_drag"))
    assert both.outcome == "exact" and not both.stated_wrong
    akin = judged(true, answer("missing_physics", "coulomb_friction", "cubic_stiffness"))  # as a magnet pulls
    assert akin.outcome == "exact" and not akin.stated_wrong
    stranger = judged(true, answer("missing_physics", "coulomb_friction", "backlash"))
    assert stranger.outcome == "wrong" and stranger.stated_wrong == ("backlash",)
    assert judged(true, answer("missing_physics", "quadratic_drag")).outcome == "wrong"


def test_the_dominant_effect_is_the_one_with_the_largest_share():
    true = truth("coulomb_friction", clutter=("quadratic_drag",))
    said = answer("missing_physics", "quadratic_drag", "coulomb_friction")
    assert not judged(true, said).dominant_first
    said["missing"][0]["share"], said["missing"][1]["share"] = 0.05, 0.9
    assert judged(true, said).dominant_first
    assert not judged(true, answer("unknown_physics")).dominant_first


def test_a_name_is_stood_by_from_a_probability_of_four_fifths():
    hesitant = judged(truth("backlash"), answer("missing_physics", "coulomb_friction", probability=0.79))
    assert hesitant.outcome == "wrong" and hesitant.stated_wrong == ()
    sure = judged(truth("backlash"), answer("missing_physics", "coulomb_friction", probability=0.8))
    assert sure.stated_wrong == ("coulomb_friction",) == sure.stated_unrelated
    declared = answer("missing_physics", "delay_drift", families=[("delay_drift", "clock_skew")])
    assert judged(truth("clock_skew"), declared).stated_wrong == ()


def test_a_wrong_name_of_the_concealed_law_s_family_is_related():
    said = answer("missing_physics", "coulomb_friction")
    akin = judged(truth("stribeck_friction"), said)
    assert akin.stated_wrong == ("coulomb_friction",) and akin.stated_unrelated == ()


def test_an_error_in_units_of_force_is_not_held_against_the_noise_of_the_motion():
    true = truth("coulomb_friction")
    by_effort = answer("missing_physics", "coulomb_friction", scoring="effort")
    assert judged(true, by_effort).heldout is None
    windows = answer("missing_physics", "coulomb_friction", scoring="windows")
    assert judged(true, windows).heldout == pytest.approx(1.05)


def test_the_reliability_diagram_counts_every_stated_name_in_its_bin():
    right = [
        judged(truth("backlash"), answer("missing_physics", "backlash", probability=p))
        for p in (0.6, 0.9, 1.0)
    ]
    wrong = [judged(truth("backlash"), answer("undecided", "sensor_lag", probability=p)) for p in (0.3, 0.9)]
    bins = {row["from"]: row for row in reliability([*right, *wrong])}
    assert [bins[edge]["right"]["of"] for edge in EDGES[:-1]] == [1, 1, 0, 2, 1]
    assert bins[0.85]["right"]["hits"] == 1 and bins[0.85]["stated"] == pytest.approx(0.9)
    assert bins[0.85]["inside"] and bins[0.7]["inside"] is None
    assert "| 0.85–0.95 | 0.90 | 1/2" in markdown([*right, *wrong], "")


def test_the_card_counts_clean_and_cluttered_cases_apart_and_by_machine():
    clean = judged(truth("backlash"), answer("missing_physics", "backlash"))
    cluttered = judged(
        truth("backlash", clutter=("magnet",), design="axis"), answer("missing_physics", "sensor_lag")
    )
    joint = replace(cluttered, design="joint", outcome="exact")
    card = summary([clean, cluttered, joint])
    assert card["single"]["cases"] == 1 and card["single, cluttered"]["cases"] == 2
    assert card["single, cluttered"]["by_machine"]["axis"]["right"]["hits"] == 0
    assert card["single, cluttered"]["by_machine"]["joint"]["right"]["hits"] == 1
    assert card["single, cluttered"]["rates"]["stated with p ≥ 0.8 and wrong"]["hits"] == 2
    assert "| joint | 1/1" in markdown([clean, cluttered, joint], "")


def test_the_interval_of_a_rate_is_wilsons():
    low, high = Rate(9, 10).interval
    assert (low, high) == pytest.approx((0.5958, 0.9821), abs=1e-4)
    assert Rate(0, 0).interval == (0.0, 1.0)


def test_the_card_counts_by_size_and_tells_what_was_confused():
    right = judged(truth("coulomb_friction", ratio=0.5), answer("missing_physics", "coulomb_friction"))
    mixed = judged(truth("coulomb_friction", ratio=2.0), answer("missing_physics", "backlash"))
    silent = judged(truth(kind="null"), answer("consistent"))
    scores = [right, mixed, replace(silent, case="null-0000")]
    assert confusion([right, mixed]) == {"coulomb_friction": {"coulomb_friction": 1, "backlash": 1}}
    card = summary(scores)
    assert card["single"]["by_size"]["0.3–1"]["exact name"]["share"] == 1.0
    assert card["single"]["by_size"]["1–3"]["exact name"]["share"] == 0.0
    assert card["null"]["rates"]["false alarms"]["hits"] == 0
    text = markdown(scores, "rhythmid proof --seed 1")
    assert "rhythmid proof --seed 1" in text
    assert "| coulomb_friction | coulomb_friction 1, backlash 1 |" in text
    assert rate(scores, lambda s: s.outcome == "exact").share == pytest.approx(1 / 3)


def test_a_family_is_right_where_something_of_it_was_concealed_or_is_clutter():
    families = [
        {"family": "friction", "laws": [], "share": 0.9, "probability": 0.93},
        {"family": "lag", "laws": [], "share": 0.1, "probability": 0.85},
        {"family": "stiffness", "laws": [], "share": 0.0, "probability": 0.2},
    ]
    one = judged(
        truth("coulomb_friction", clutter=("sensor_lag",)), answer("undecided") | {"families": families}
    )
    assert [(kind.right, kind.related) for kind in one.kinds] == [(True, True), (True, False), (False, False)]
    assert len(one.kinds_stated) == 2 and one.kind_right
    other = judged(truth("second_mode"), answer("undecided") | {"families": families})
    assert not other.kind_right and "| 0/1 = 0.0 %" in markdown([other], "proof")
    assert not judged(truth("coulomb_friction"), answer("undecided")).kinds


def test_a_score_is_read_as_it_was_written(tmp_path):
    families = [{"family": "friction", "laws": [], "share": 0.9, "probability": 0.93}]
    said = answer("missing_physics", "coulomb_friction", families=[("coulomb_friction", "backlash")])
    made = judged(truth("coulomb_friction", clutter=("sensor_lag",)), said | {"families": families})
    path = tmp_path / "score.json"
    write_json(path, asdict(made))
    assert read_score(path) == made and made.kinds_stated and made.effects
