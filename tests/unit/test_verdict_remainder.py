"""The verdict on what the names leave: small remainders, free functions that predict more, and records that would not show it."""

from dataclasses import replace

import numpy as np
import pytest
from contests import NAMED, NOMINAL, NOTHING, SIZE, contest, decided, friction, predicted, supposed, verdict

from rhythmid.diagnose.verdict import lost_share, significance


@pytest.mark.parametrize(
    ("left", "expected"), [(0.75, "unknown_physics"), (0.6, "unknown_physics"), (0.01, "missing_physics")]
)
def test_names_that_leave_most_of_what_a_free_map_explains_are_unknown_physics(left, expected):
    made = contest(NOMINAL, friction(left), maps={"velocity": predicted(1e-4)})
    _, decision = decided(made)
    assert (decision.verdict, decision.named) == (expected, ("friction",))
    assert decision.unexplained.share == pytest.approx(left, abs=0.02)
    assert decision.unexplained.goes_with == "velocity"


@pytest.mark.parametrize("left", [0.3, 0.7])
def test_names_that_leave_a_part_are_not_stated_and_the_reason_tells_the_part(left):
    _, decision = decided(contest(NOMINAL, friction(left), maps={"velocity": predicted(1e-4)}))
    assert (decision.verdict, decision.named) == ("unknown_physics", ("friction",))
    assert f"leave {100 * left:.0f} % of the mismatch" in decision.reason
    assert "velocity" in decision.reason and decision.joint < 0.8


@pytest.mark.parametrize(("left", "expected"), [(0.01, "unknown_physics"), (0.6, "missing_physics")])
def test_what_more_effects_would_explain_though_they_are_not_granted_is_left_over(left, expected):
    more = supposed("friction play", predicted(left), shape={"within_bounds": 0.0})
    _, decision = decided(contest(NOMINAL, friction(0.6), more, maps={"velocity": predicted(0.58, 0.0)}))
    assert decision.verdict == expected and decision.named == ("friction",)
    told = "further effects that are not established (play)"
    assert (decision.unexplained.goes_with == told) is (expected == "unknown_physics")
    assert (decision.unexplained.further == ("play",)) is (expected == "unknown_physics")


def test_a_small_structured_remainder_does_not_take_the_name_away():
    made = contest(NOMINAL, friction(0.02), maps={"position": predicted(0.01)})
    _, decision = decided(made)
    assert (decision.verdict, decision.named) == NAMED
    assert decision.unexplained.significant and 0.0 < decision.unexplained.share < 0.02
    assert decision.probability["friction"] >= 0.8


def test_what_no_name_explains_but_a_free_map_does_is_unknown_physics_and_told_by_its_quantity():
    maps = {"position": predicted(0.5), "velocity": predicted(0.1)}
    _, decision = decided(contest(NOMINAL, friction(0.999), maps=maps))
    assert (decision.verdict, decision.named) == ("unknown_physics", ())
    assert "velocity" in decision.reason and decision.unexplained.goes_with == "velocity"


def test_what_a_free_map_explains_by_chance_or_of_no_practical_size_is_nothing():
    chance = predicted(0.1, NOMINAL.prediction.score + 5.0, mood=10.0)
    assert verdict(contest(NOMINAL, maps={"velocity": chance})) == NOTHING
    tiny = supposed("", predicted(1e-8 + (0.001 * SIZE) ** 2, 0.0))
    assert verdict(contest(tiny, maps={"velocity": predicted(1e-8, 1e4)})) == NOTHING


@pytest.mark.parametrize(("uneven", "expected"), [(0.0, "unknown_physics"), (0.9, "consistent")])
def test_a_remainder_counts_where_it_is_of_practical_size_beyond_what_its_estimate_scatters(uneven, expected):
    least = (0.003 * SIZE) ** 2
    nominal, mapped = supposed("", predicted(2.0 * least, 0.0)), predicted(0.5 * least, 1e4)
    blocks = np.arange(len(mapped.squared_error))
    wave = np.where(blocks % 12 == 0, 1.0 + 11.0 * uneven, 1.0 - uneven)  # a few blocks tell it, or all alike
    gained = nominal.prediction.squared_error.mean() - mapped.squared_error.mean()
    mapped = replace(mapped, squared_error=nominal.prediction.squared_error - gained * wave)
    _, decision = decided(contest(nominal, maps={"velocity": mapped}))
    assert decision.verdict == expected and decision.unexplained.significant


def test_more_rivals_and_fewer_blocks_ask_for_more_of_what_is_left():
    one = predicted(0.1)
    few = replace(one, log_density=one.log_density[:6])
    assert significance(one, 1) < significance(one, 30) < significance(few, 30)
    assert significance(one, 0) == significance(one, 1)


@pytest.mark.parametrize(("detectable", "expected"), [(0.001, "consistent"), (0.8, "undecided")])
def test_records_that_would_not_show_an_effect_decide_nothing(detectable, expected):
    assert verdict(contest(NOMINAL, friction(0.999)), detectable)[0] == expected


@pytest.mark.parametrize(("missed", "expected"), [(0.1, "consistent"), (0.5, "undecided")])
def test_a_model_that_misses_much_is_not_called_consistent_though_nothing_explains_it(missed, expected):
    nominal = supposed("", predicted((missed * SIZE) ** 2))
    _, decision = decided(contest(nominal))
    assert decision.verdict == expected
    assert ("misses" in decision.reason) is (expected == "undecided")


@pytest.mark.parametrize(
    ("missed", "share", "expected"),
    [
        (0.04, 1.0, "consistent"),
        (0.06, 1.0, "undecided"),
        (0.15, 0.83, "undecided"),
        (0.15, 0.2, "consistent"),
    ],
)
def test_a_mismatch_that_is_no_noise_is_not_called_consistent_though_nothing_explains_it(
    missed, share, expected
):
    made = replace(contest(supposed("", predicted((missed * SIZE) ** 2))), structured=share)
    _, decision = decided(made)
    assert decision.verdict == expected
    assert ("not noise" in decision.reason) is (expected == "undecided")


def test_records_that_would_not_show_a_small_effect_still_show_a_large_one():
    assert verdict(contest(NOMINAL, friction()), 0.8) == NAMED


@pytest.mark.parametrize(
    ("share", "expected"), [(0.0, "missing_physics"), (0.5, "missing_physics"), (1.0, "undecided")]
)
def test_a_name_is_not_stated_where_much_is_left_that_follows_from_its_own_past_though_nothing_explains_it(
    share, expected
):
    # of the mismatch 30 % of the motion, 15 % are left
    made = contest(supposed("", predicted((0.3 * SIZE) ** 2)), friction((0.15 * SIZE) ** 2))
    assert verdict(replace(made, structured_after=share))[0] == expected


def test_what_models_of_real_machines_leave_says_nothing_against_a_name():
    made = contest(supposed("", predicted((0.3 * SIZE) ** 2)), friction((0.049 * SIZE) ** 2))
    assert lost_share(replace(made, structured_after=1.0), made.hypotheses[1]) == 0.0
