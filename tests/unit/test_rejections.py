"""Rejections: one table of rows, each with its statistic, its threshold and its reason."""

import math
from dataclasses import replace

import numpy as np
import pytest
from contests import SIZE, predicted, supposed

from rhythmid.diagnose.rejections import (
    CHANCE,
    FEW,
    HARM,
    INSTEAD,
    RULES,
    SHAPES,
    Claim,
    decisive,
    rejections_of,
    table,
)

NOMINAL = supposed("", predicted(1.0))
GOOD = Claim(supposed("friction", predicted(0.01)), NOMINAL, NOMINAL, 0.01, 30, SIZE, 0.01)


def rejected(claim: Claim) -> list[str]:
    return [row.name for row in rejections_of(claim)]


def test_nothing_speaks_against_an_effect_that_explains_all():
    assert rejected(GOOD) == []


@pytest.mark.parametrize(
    ("name", "claim"),
    [
        ("predicts_better", replace(GOOD, hypothesis=supposed("friction", predicted(0.01, 1.0, mood=5.0)))),
        ("share_of_rest", replace(GOOD, without=supposed("cubic", predicted(0.011, -100.0)), floor=0.0)),
        ("share_of_mismatch", replace(GOOD, nominal=supposed("", predicted(1e6)))),
        ("practical_size", replace(GOOD, practical=2.0)),
        ("within_bounds", replace(GOOD, hypothesis=replace(GOOD.hypothesis, shape={"within_bounds": 0.0}))),
        (
            "moves_the_machine",
            replace(GOOD, hypothesis=replace(GOOD.hypothesis, shape={"moves_the_machine": 0.4})),
        ),
        (
            "more_than_gain",
            replace(GOOD, hypothesis=replace(GOOD.hypothesis, shape={"more_than_gain": 0.1})),
        ),
        ("beats_simpler", replace(GOOD, simpler=supposed("plain", predicted(0.01), free=3))),
    ],
)
def test_each_row_rejects_what_it_is_for(name, claim):
    assert name in rejected(claim)
    (row,) = [row for row in rejections_of(claim) if row.name == name]
    assert row.statistic < row.threshold and row.hypothesis == ("friction",)


def test_every_row_is_told_and_not_only_the_first():
    worse = replace(GOOD, hypothesis=supposed("friction", predicted(2.0), shape={"within_bounds": 0.0}))
    assert rejected(worse) == [
        "predicts_better", "share_of_rest", "share_of_mismatch", "practical_size", "within_bounds",
    ]  # fmt: skip


def test_a_statistic_that_is_no_number_rejects():
    broken = replace(GOOD, hypothesis=replace(GOOD.hypothesis, shape={"within_bounds": math.nan}))
    assert rejected(broken) == ["within_bounds"]


def test_more_candidates_ask_for_more():
    assert decisive(0) == decisive(1) < decisive(30)
    assert math.exp(-decisive(1)) == pytest.approx(0.025)


@pytest.mark.parametrize(("blocks", "believed"), [(1, False), (2, False), (5, True)])
def test_an_effect_that_acts_in_few_blocks_is_believed_and_in_one_it_is_not(blocks, believed):
    without = NOMINAL.prediction
    density = without.log_density.copy()
    density[:blocks] += 100.0
    claim = replace(GOOD, hypothesis=supposed("friction", replace(predicted(0.1), log_density=density)))
    assert ("predicts_better" not in rejected(claim)) == believed


def why(density: np.ndarray, mean_square: float = 0.1, **more) -> str:
    """Why an effect does not predict better, whose blocks gain so much each in log density."""
    made = replace(predicted(mean_square), log_density=NOMINAL.prediction.log_density + density)
    claim = replace(GOOD, hypothesis=supposed("friction", made), floor=0.0, **more)
    (row,) = [row for row in rejections_of(claim) if row.name == "predicts_better"]
    return row.reason


def test_the_reason_why_an_effect_predicts_no_better_is_the_true_one():
    blocks = np.zeros(60)
    harmful, few, small = blocks + 1.0, blocks.copy(), blocks + 0.05
    harmful[:5] = -30.0  # it halves the error, and single blocks count against it
    few[:2] = 100.0
    assert why(harmful, 0.5) == HARM
    assert why(few) == FEW
    assert why(small, 0.98) == CHANCE
    rival = replace(supposed("hysteresis", NOMINAL.prediction), elements=("hysteresis",))
    assert why(small, 0.98, without=rival) == INSTEAD
    assert all(reason in table() for reason in (HARM, FEW, CHANCE, INSTEAD))


def test_predictions_that_agree_to_the_last_digit_gain_nothing():
    same = replace(GOOD, hypothesis=replace(GOOD.hypothesis, prediction=NOMINAL.prediction))
    assert "practical_size" in rejected(same) and "share_of_rest" in rejected(same)


def test_names_of_rows_are_their_own_and_the_documentation_has_them_all():
    names = [rule.name for rule in RULES]
    assert len(set(names)) == len(names) and set(SHAPES) <= set(names)
    lines = table().splitlines()
    assert len(lines) == 2 + len(RULES)
    for rule, line in zip(RULES, lines[2:]):
        assert f"`{rule.name}`" in line and rule.says in line and rule.reason in line
