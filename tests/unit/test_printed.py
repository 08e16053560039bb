"""What the terminal says of a diagnosis."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from rhythmid.diagnose.answer.printed import rejection_words, remainder_words, scoring_words, show
from rhythmid.diagnose.answer.result import (
    Detection,
    Diagnosis,
    Estimate,
    Explanation,
    FitQuality,
    Location,
    MissingEffect,
    Remainder,
    Scored,
    Untried,
)
from rhythmid.diagnose.family import MissingFamily
from rhythmid.diagnose.hypothesis import Kind
from rhythmid.diagnose.joints.printed import left_words
from rhythmid.diagnose.rejections import Rejection


def explanation(
    elements: tuple[str, ...], worse: float, probability: float, kind: Kind = "effects"
) -> Explanation:
    return Explanation(elements, kind, 100.0 - worse, worse, 0.3 * worse, probability, 0.0123)


FRICTION = MissingEffect(
    "coulomb_friction", "force", "F = −F_c sgn v", 0.92, 0.97, {"force": Estimate(0.8, 0.01, "N")}
)
LIMIT = Rejection(
    ("second_mode",),
    "within_bounds",
    0.0,
    1e-3,
    "only a limit of its parameters is identifiable, where it is another effect",
)
ANSWER = Diagnosis(
    "missing_physics",
    "The model lacks coulomb friction.",
    Detection(1e-9, None, 0.05, 0.004),
    Location("force", "in the balance of forces on the mass", ()),
    (FRICTION,),
    0.97,
    (),
    (),
    (
        explanation(("coulomb_friction", "position_ripple"), 0.0, 0.0),
        explanation(("coulomb_friction",), 2.0, 0.97),
        explanation((), 500.0, 0.0, "nominal"),
    ),
    (LIMIT,),
    Remainder(0.03, True, "velocity", None),
    {"refitted_nominal": FitQuality(0.05, 0.06), "augmented": FitQuality(0.01, None)},
    {},
    {},
    "a slow reversal [of the speed]",
    Scored("effort", 12.0, "a controller holds the machine", 1),
    assumptions=("The recorded effort is taken to be true in scale.",),
    excluded=(Untried("sensor_lag", "not seen"), Untried("sensor_drift", "not seen")),
    chosen=("coulomb_friction",),
)


def printed(answer: Diagnosis = ANSWER) -> str:
    console = Console(file=io.StringIO(), width=160)
    show(answer, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize(
    "line",
    [
        "missing physics: The model lacks coulomb friction.",
        "probability 97 %, 92 % of the mismatch",
        "remainder: 3 % of the mismatch, which depends on velocity",
        "scored: by the recorded effort below 12 Hz: a controller holds the machine",
        "assumption: The recorded effort is taken to be true in scale.",
        "not tried: sensor_lag, sensor_drift: not seen",
        "rejected: second mode (only a limit of its parameters is identifiable, where it is another effect)",
        "refitted nominal: NRMSE 0.05 on fitted data, 0.06 held out",
        "augmented: NRMSE 0.01 on fitted data, — held out",
        "next experiment: a slow reversal [of the speed]",
    ],
)
def test_the_terminal_says(line):
    assert line in printed()


def test_hypotheses_stand_in_a_table_with_differences_and_weights_of_evidence():
    rows = [line for line in printed().splitlines() if line.startswith("│")][1:]
    best, chosen, nominal = rows
    assert "coulomb_friction + position_ripple" in best and "best" in best
    assert "coulomb_friction (chosen)" in chosen and "2.00 ± 0.60" in chosen and "0.97" in chosen
    assert "nominal model" in nominal and "500 ± 150" in nominal and "0.00" in nominal


def test_hypotheses_that_take_no_share_of_the_evidence_have_no_probability():
    rows = [line for line in printed().splitlines() if "position_ripple" in line]
    assert "%" not in rows[0].split("best")[1].split("│")[1]


@pytest.mark.parametrize("verdict", ["unknown_physics", "undecided"])
def test_an_effect_that_the_verdict_does_not_stand_by_has_no_probability(verdict):
    text = printed(replace(ANSWER, verdict=verdict))
    assert "coulomb_friction: F = −F_c sgn v   (92 % of the mismatch)" in text
    assert "probability" not in text and "97 %" not in text
    assert "weight of evidence" in text and "0.97" in text


def test_a_value_has_the_digits_that_its_standard_deviation_bears():
    effect = replace(FRICTION, parameters={"force": Estimate(0.81234567, 0.012, "N")})
    assert "0.812 " in printed(replace(ANSWER, missing=(effect,)))


def test_only_a_few_hypotheses_are_shown():
    many = tuple(explanation((f"effect_{i}",), float(i), 0.01) for i in range(20))
    text = printed(replace(ANSWER, hypotheses=many))
    assert "the 6 best of 20 hypotheses" in text and "effect_5" in text and "effect_6" not in text


def test_the_chosen_hypothesis_is_shown_however_many_predict_better():
    many = tuple(explanation(("coulomb_friction", f"effect_{i}"), float(i), 0.0) for i in range(20))
    text = printed(replace(ANSWER, hypotheses=(*many, explanation(("coulomb_friction",), 30.0, 0.9))))
    assert "the 6 best of 21 hypotheses, and the chosen one" in text
    assert "coulomb_friction (chosen)" in text and "30 ± 9" in text and "effect_6" not in text


def test_what_is_not_believed_comes_in_the_order_of_the_hypotheses_and_is_no_rival_of_the_chosen_one():
    def refused(*elements: str) -> Rejection:
        return Rejection(elements, "share_of_rest", 0.0, 0.2, "too small a part")

    rows = (
        refused("position_ripple"),
        refused("stribeck_friction"),
        refused("coulomb_friction", "position_ripple"),
    )
    alike = (("coulomb_friction", "stribeck_friction"),)
    text = printed(replace(ANSWER, rejections=rows, indistinguishable=alike))
    said = [line for line in text.splitlines() if line.startswith("rejected")]
    assert said == [
        "rejected: coulomb friction + position ripple (too small a part)",
        "rejected: position ripple (too small a part)",
    ]


def test_only_a_few_rejections_are_told_and_the_rest_is_counted():
    rows = [Rejection((f"effect_{i}",), "share_of_rest", 0.0, 0.2, "too small a part") for i in range(8)]
    told = rejection_words([LIMIT, LIMIT, *rows])
    assert len(told) == 6 and told[0].startswith("second mode") and told[-1].startswith("and 4 more")


def test_nothing_left_and_a_free_run_are_told_in_words():
    assert "nothing" in remainder_words(replace(ANSWER, remainder=Remainder(0.0, False, None, None)))
    assert scoring_words(Scored("free_run", None, "the model follows", 1)) == "in free run: the model follows"


def test_an_error_of_averaged_samples_is_said_to_be_one():
    lines = printed(replace(ANSWER, scoring=Scored("free_run", None, "it follows", 4))).splitlines()
    errors = [line for line in lines if "NRMSE" in line]
    assert len(errors) == 2
    assert all("NRMSE (of means of 4 samples) 0.0" in line for line in errors)


def test_where_nothing_is_missing_what_is_left_is_told_as_an_error_and_not_as_a_share_of_no_mismatch():
    fit = {**ANSWER.fit, "refitted_nominal": FitQuality(2.2e-4, 1.5e-4)}
    left = Remainder(1.0, True, "velocity", None)
    moved = Scored("free_run", None, "the model follows", 1)
    told = remainder_words(replace(ANSWER, verdict="consistent", remainder=left, fit=fit, scoring=moved))
    assert told == "the model misses 0.015 % of the motion, part of which depends on velocity"
    assert "100 % of the mismatch" in remainder_words(replace(ANSWER, verdict="undecided", remainder=left))


def test_the_nominal_model_alone_has_no_probability():
    alone = (explanation((), 0.0, 1.0, "nominal"), explanation(("inertia.mass",), 2.5, 0.0, "freed_value"))
    rows = [line for line in printed(replace(ANSWER, hypotheses=alone)).splitlines() if "│" in line]
    assert all("—" in row for row in rows if "nominal model" in row or "inertia.mass" in row)


def test_the_verdict_is_not_said_twice():
    told = printed(replace(ANSWER, verdict="undecided", summary="Two names do equally well."))
    assert told.startswith("undecided: Two names do equally well.")


def test_several_names_come_with_their_joint_probability():
    lag = replace(FRICTION, element="actuator_lag")
    assert "joint probability of these names: 97 %" in printed(replace(ANSWER, missing=(FRICTION, lag)))


@pytest.mark.parametrize(
    ("verdict", "left", "words"),
    [
        ("missing_physics", Remainder(1.0, True, "velocity", None), "100 % of the mismatch"),
        ("missing_physics", Remainder(0.034, True, "velocity", None), "3 % of the mismatch"),
        ("missing_physics", Remainder(0.0, False, None, None), "noise"),
        ("consistent", Remainder(1.0, True, "velocity", None), "—"),
    ],
)
def test_what_is_left_at_a_joint_is_a_plain_share_and_nothing_where_nothing_is_missing(verdict, left, words):
    assert left_words(replace(ANSWER, verdict=verdict, remainder=left)) == words


def test_an_error_of_the_size_of_the_effort_is_not_called_noise():
    fit = {**ANSWER.fit, "augmented": FitQuality(1.3, 1.32)}
    assert left_words(replace(ANSWER, verdict="undecided", remainder=Remainder(0.0, False, None, None), fit=fit)) == "not explained"  # fmt: skip


def test_of_an_undecided_answer_the_families_are_told_with_their_probability():
    family = MissingFamily("friction", ("coulomb_friction", "stribeck_friction"), 0.9, 0.93)
    told = printed(replace(ANSWER, verdict="undecided", families=(family,)))
    assert (
        "some form of friction: probability 93 %, 90 % of the mismatch: coulomb_friction, stribeck_friction"
        in told
    )
    assert "some form of" not in printed(replace(ANSWER, families=(family,)))
