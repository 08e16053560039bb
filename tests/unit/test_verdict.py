"""The verdict that a user reads: every rule through it, once where it must act and once where it must not."""

from dataclasses import replace

import pytest
from contests import (
    BLOCKS,
    NAMED,
    NOMINAL,
    NOTHING,
    SIZE,
    contest,
    decided,
    ends,
    friction,
    predicted,
    supposed,
    verdict,
)

from rhythmid.diagnose.answer.result import FitQuality, MissingEffect
from rhythmid.diagnose.answer.wording import summary_of
from rhythmid.diagnose.constants import FOLLOWS, HOLDS, RICHER
from rhythmid.diagnose.rejections import RULES

# what is missing


def test_an_effect_that_predicts_far_better_than_the_nominal_model_is_named():
    assert verdict(contest(NOMINAL, friction())) == NAMED


def test_a_nominal_model_that_nothing_beats_is_consistent():
    assert verdict(contest(NOMINAL, friction(0.999))) == NOTHING
    assert verdict(contest(NOMINAL)) == NOTHING


@pytest.mark.parametrize(
    ("standard_errors", "expected"), [(1.0, NOTHING), (2.0, NOTHING), (8.0, NAMED), (30.0, NAMED)]
)
def test_a_gain_that_chance_would_find_among_as_many_candidates_is_none(standard_errors, expected):
    # the same moods for all but the gain: a standard error of √60 · 0.1
    gain = standard_errors * BLOCKS**0.5 * 5.0
    nominal = supposed("", predicted(1.0, 0.0, mood=0.0))
    found = supposed("friction", predicted(0.1, gain, mood=5.0))
    assert verdict(contest(nominal, found)) == expected


@pytest.mark.parametrize(("share", "expected"), [(0.001, NOTHING), (0.01, NAMED), (0.1, NAMED)])
def test_an_effect_of_a_thousandth_of_the_motion_is_not_named_and_one_of_a_hundredth_is(share, expected):
    # however sure it is, and although nothing else is to be explained
    quiet = 1e-8
    nominal = supposed("", predicted(quiet + (share * SIZE) ** 2, 0.0))
    assert verdict(contest(nominal, supposed("friction", predicted(quiet, 1e4)))) == expected


@pytest.mark.parametrize(("gain", "expected"), [(2.0, NAMED), (0.0, NAMED), (-0.1, NAMED), (-2.0, NOTHING)])
def test_an_effect_that_does_worse_on_held_out_data_is_not_named(gain, expected):
    nominal = supposed("", ends(NOMINAL.prediction, 0.0, mood=0.0))
    found = supposed("friction", ends(friction().prediction, gain))
    assert verdict(contest(nominal, found)) == expected


@pytest.mark.parametrize(
    ("gain", "expected"), [(2.0, "unknown_physics"), (-0.1, "unknown_physics"), (-2.0, "consistent")]
)
def test_a_line_that_does_not_go_on_in_held_out_data_is_no_unknown_physics(gain, expected):
    quiet = replace(predicted(1e-4), unseen=None)
    nominal = supposed("", ends(NOMINAL.prediction, 0.0, mood=0.0))
    line = {"a vibration at 2 Hz": ends(quiet, gain)}
    assert verdict(contest(nominal, maps=line))[0] == expected


@pytest.mark.parametrize(("unnamed", "expected"), [(0.05, "unknown_physics"), (0.2, "consistent")])
def test_a_remainder_that_no_name_explains_counts_from_a_size_of_its_own(unnamed, expected):
    made = contest(NOMINAL, maps={"position": predicted(0.1)})
    assert verdict(replace(made, unnamed=unnamed))[0] == expected


@pytest.mark.parametrize(("left", "expected"), [(0.19, 1), (0.05, 2)])
def test_a_further_effect_has_to_remove_more_than_a_small_part_of_what_can_still_be_explained(left, expected):
    both = supposed("friction cubic", predicted(left, 2200.0))
    made = contest(
        NOMINAL,
        friction(0.2, score=2000.0),
        both,
        maps={"position": predicted(1e-4, 100.0)},
    )
    assert verdict(made) == ("missing_physics", ("friction", "cubic")[:expected])


@pytest.mark.parametrize(("size", "expected"), [(1e-4, 1), (0.03, 2)])
def test_a_further_effect_has_to_remove_some_of_the_whole_mismatch(size, expected):
    # although it removes all of what is left
    quiet = 1e-5
    made = contest(
        NOMINAL,
        friction(quiet + size, score=200.0),
        supposed("friction cubic", predicted(quiet, 2000.0)),
        practical=1e-5,
    )
    assert verdict(made) == ("missing_physics", ("friction", "cubic")[:expected])


@pytest.mark.parametrize("rule", ["within_bounds", "moves_the_machine", "more_than_gain"])
def test_an_effect_that_has_lost_its_shape_is_no_name_and_the_next_best_comes_in_its_place(rule):
    lost = supposed("play", predicted(0.05), shape={rule: 0.0})
    assert verdict(contest(NOMINAL, lost, friction()))[1] == ("friction",)
    assert verdict(contest(NOMINAL, lost))[1] == ()
    kept = replace(lost, shape={rule: 1e3})
    assert verdict(contest(NOMINAL, kept, friction()))[1] == ("play",)


@pytest.mark.parametrize(("share", "expected"), [(0.0, ()), (0.45, ()), (0.55, ("friction",))])
def test_an_actuators_law_that_is_mainly_a_gain_on_what_was_recorded_is_no_name(share, expected):
    assert verdict(contest(NOMINAL, replace(friction(), shape={"more_than_gain": share})))[1] == expected


def test_an_effect_is_stated_beside_a_freed_value_that_explains_little():
    both = supposed("friction inertia.mass", predicted(0.01), "freed_value")
    mass = supposed("inertia.mass", predicted(0.9), "freed_value")
    assert verdict(contest(NOMINAL, friction(0.03), mass, both)) == (
        "missing_physics",
        ("friction", "inertia.mass"),
    )


def test_a_freed_value_that_explains_most_is_not_hidden_by_an_effect_beside_it():
    both = supposed("friction inertia.mass", predicted(0.01), "freed_value")
    mass = supposed("inertia.mass", predicted(0.1), "freed_value")
    assert verdict(contest(NOMINAL, friction(0.9), mass, both))[0] == "undecided"


@pytest.mark.parametrize(
    ("error", "expected"), [(0.29, "missing_physics"), (0.31, "undecided"), (None, "missing_physics")]
)
def test_no_name_is_stated_where_the_model_does_not_follow_the_held_out_motion_with_it(error, expected):
    named = replace(friction(), heldout_nrmse=error)
    assert verdict(replace(contest(NOMINAL, named), follows=FOLLOWS)) == (expected, ("friction",))
    assert verdict(contest(NOMINAL, named))[0] == "missing_physics"  # an effort, whose noise may be as large


def test_what_the_search_has_ruled_out_is_told_and_changes_nothing_else():
    made = contest(NOMINAL, friction(0.2), maps={"velocity": predicted(0.1)})
    taken = supposed("gain", predicted(1e-6), shape={"more_than_gain": 0.1})
    beside = replace(made, ruled_out=(taken, replace(taken, elements=("friction", "gain"))))
    (plain, decision), (found, same) = decided(made), decided(beside)
    assert same == decision and found.chosen is plain.chosen
    told = [(row.hypothesis, row.name) for row in found.rejections if row not in plain.rejections]
    assert told == [(("gain",), "more_than_gain"), (("friction", "gain"), "more_than_gain")]


@pytest.mark.parametrize(("gain", "expected"), [(0.5, "plain"), (200.0, "friction")])
def test_a_law_with_more_parameters_is_named_where_it_predicts_better_and_else_told_to_lose(gain, expected):
    simple = supposed("plain", predicted(0.1001, 700.0), free=6)
    found, decision = decided(contest(NOMINAL, friction(score=700.0 + gain, free=9), simple))
    assert found.chosen.elements == (expected,)
    lost = [row for row in found.rejections if row.name == "beats_simpler"]
    assert [row.hypothesis for row in lost] == ([("friction",)] if expected == "plain" else [])
    assert decision.verdict == ("missing_physics" if expected == "friction" else "undecided")


@pytest.mark.parametrize(
    ("gain", "simple", "left", "row"),
    [
        (2.0, 0.2, 0.05, "beats_simpler"),
        (300.0, 0.2, 0.17, "share_of_rest"),
        (300.0, 0.9 * RICHER, 0.0, "share_of_mismatch"),
        (300.0, 1.2 * RICHER, 0.0, None),
        (10.0, 0.2, 0.05, None),
    ],
)
def test_a_richer_law_takes_the_place_of_one_that_it_contains_where_it_removes_more_than_small_effects_do(
    gain, simple, left, row
):
    contained = supposed("plain", predicted(simple, 700.0), free=6, richer={"plain": ("friction",)})
    rich = friction(left, score=700.0 + gain, free=7)
    found, decision = decided(contest(NOMINAL, contained, rich, maps={"velocity": predicted(0.0, 100.0)}))
    assert found.chosen.elements == (("friction",) if row is None else ("plain",))
    assert [one.name for one in found.rejections if one.hypothesis == ("friction",)] == [row] * (
        row is not None
    )
    assert decision.named == found.chosen.elements


def test_every_rule_of_the_table_is_one_whose_effect_on_the_verdict_is_tested():
    tested = {
        "predicts_better", "predicts_ahead", "share_of_rest", "share_of_mismatch", "practical_size", "within_bounds",
        "moves_the_machine", "more_than_gain", "beats_simpler",
    }  # fmt: skip
    assert {rule.name for rule in RULES} == tested


# names that compete


def test_effects_that_predict_alike_are_undecided_and_all_listed():
    score = predicted(0.1).score
    rivals = [
        supposed(name, predicted(0.1, score, seed=i)) for i, name in enumerate(("friction", "stribeck"))
    ]
    _, decision = decided(contest(NOMINAL, *rivals))
    assert decision.verdict == "undecided"
    assert [set(group) for group in decision.equivalent] == [{"friction", "stribeck"}]
    for one in rivals:
        assert decision.weights[one.key] == pytest.approx(0.5, abs=0.2)


def test_an_effect_that_predicts_clearly_better_than_its_kin_is_named_alone():
    _, decision = decided(contest(NOMINAL, friction(), supposed("stribeck", predicted(0.4))))
    assert (decision.verdict, decision.named, decision.equivalent) == (*NAMED, ())


def test_kin_that_make_one_law_together_do_not_stand_together():
    # each explains nearly all; both together correct one another by a part of what is left
    kin = [supposed(name, predicted(ms)) for name, ms in (("friction", 0.05), ("stribeck", 0.6))]
    both = supposed("friction stribeck", predicted(0.0485, predicted(0.05).score + 50.0))
    made = contest(NOMINAL, *kin, both, maps={"velocity": predicted(0.04)})
    assert verdict(made) == NAMED


def test_two_effects_of_which_each_explains_its_own_stand_together():
    alone = [supposed(name, predicted(ms)) for name, ms in (("friction", 0.3), ("cubic", 0.7))]
    both = supposed("friction cubic", predicted(0.01))
    assert verdict(contest(NOMINAL, *alone, both)) == ("missing_physics", ("friction", "cubic"))


def test_names_come_in_the_order_of_their_shares():
    alone = [supposed(name, predicted(ms)) for name, ms in (("cubic", 0.7), ("friction", 0.3))]
    _, decision = decided(contest(NOMINAL, *alone, supposed("cubic friction", predicted(0.01))))
    assert decision.named == ("friction", "cubic")
    assert decision.shares["friction"] > decision.shares["cubic"] > 0.0


def test_the_simpler_of_two_laws_that_predict_alike_is_chosen():
    score = predicted(0.1).score
    wide = friction(score=score, free=9)
    simple = supposed("plain", predicted(0.1001, score - 0.5), free=6)
    assert decided(contest(NOMINAL, wide, simple))[0].chosen is simple
    clear = friction(0.02, free=9)
    assert decided(contest(NOMINAL, clear, simple))[0].chosen is clear


@pytest.mark.parametrize(
    ("left", "expected"),
    [(1e-6, ("friction", "cubic")), (0.004, ("friction", "cubic")), (0.014, ("friction",))],
)
def test_a_small_effect_beside_a_large_one_is_stated_where_no_more_of_its_size_is_left_than_small_effects_leave(
    left, expected
):
    both = supposed("friction cubic", predicted(0.0145, 900.0))
    made = contest(
        NOMINAL,
        friction(0.0295, score=500.0),
        both,
        maps={"position": predicted(0.0145 - left, 1100.0 if left > 1e-3 else 900.0)},
    )
    _, decision = decided(made)
    assert (decision.verdict, decision.named) == ("missing_physics", expected)
    assert set(decision.beside) == {"friction", "cubic"} - set(expected)
    named = [MissingEffect(name, "force", "", 1.0, 1.0, {}) for name in decision.named]
    said = summary_of(decision, named, FitQuality(0.1, 0.1), FitQuality(0.01, 0.01), "motion")
    assert ("With it and cubic, which is too uncertain to be named, the error" in said) == (len(named) == 1)


def test_a_second_name_that_is_open_does_not_take_the_first_one_with_it():
    first = friction(0.2)
    score = predicted(0.05).score
    pairs = [
        supposed(f"friction {name}", predicted(0.05, score, seed=i)) for i, name in enumerate(("a", "b"))
    ]
    _, decision = decided(contest(NOMINAL, first, *pairs))
    assert (decision.verdict, decision.named) == NAMED
    assert decision.joint >= 0.8
    assert all(decision.probability[label] < 0.8 for label in ("a", "b") if label in decision.probability)
    assert decision.equivalent == ()  # that a and b are not separated says nothing of friction


@pytest.mark.parametrize(("second", "stated"), [("ripple", True), ("cubic", False)])
def test_a_small_further_line_of_the_same_law_does_not_put_the_law_in_doubt(second, stated):
    both = replace(supposed(f"ripple {second}_2", predicted(0.04, 900.0)), names=("ripple", second))
    alone = supposed("ripple", predicted(0.16, 500.0))
    _, decision = decided(contest(NOMINAL, alone, both), errors={f"{second}_2": 1.0})
    assert (decision.probability["ripple"] >= 0.8) == stated


def test_names_that_are_not_stood_by_have_no_high_joint_probability():
    score = predicted(0.1).score
    rivals = [supposed(name, predicted(0.1, score, seed=i)) for i, name in enumerate("abc")]
    _, decision = decided(contest(NOMINAL, *rivals))
    assert decision.verdict == "undecided" and decision.joint < 0.8


# other kinds of explanation


@pytest.mark.parametrize(("moved", "expected"), [(0.01, "undecided"), (0.5, "missing_physics")])
def test_an_effect_that_predicts_better_in_a_place_where_the_catalogue_has_nothing_is_no_name(
    moved, expected
):
    lag = supposed("actuator_lag", predicted(0.1))
    elsewhere = supposed("actuator_lag_of_the_sensor", predicted(moved), "location")
    found, decision = decided(contest(NOMINAL, lag, elsewhere))
    assert decision.verdict == expected
    assert (found.chosen.kind == "location") is (expected == "undecided")


@pytest.mark.parametrize(("freed", "expected"), [(0.01, "undecided"), (0.5, "missing_physics")])
def test_a_fixed_value_that_explains_more_when_it_is_free_is_told_instead_of_a_name(freed, expected):
    mass = supposed("inertia.mass", predicted(freed), "freed_value")
    _, decision = decided(contest(NOMINAL, friction(), mass))
    assert decision.verdict == expected
    assert (decision.named == ("friction",)) is (expected == "missing_physics")


@pytest.mark.parametrize(("late", "expected"), [(0.01, "undecided"), (0.5, "missing_physics")])
def test_a_longer_delay_is_a_parameter_and_no_name_of_an_effect(late, expected):
    delay = supposed("input_delay.delay", predicted(late), "delay")
    _, decision = decided(contest(NOMINAL, friction(), delay))
    assert decision.verdict == expected
    assert ("longer delay" in decision.reason) is (expected == "undecided")


@pytest.mark.parametrize(
    ("law", "expected"), [(0.01, "unknown_physics"), (0.5, "missing_physics"), (0.98, "missing_physics")]
)
def test_one_free_law_that_predicts_as_well_as_a_series_of_names_is_unknown_physics(law, expected):
    one = supposed("free_force_of_position", predicted(law), "free_map")
    alone = [supposed(name, predicted(ms)) for name, ms in (("quadratic", 0.4), ("cubic", 0.3))]
    made = contest(NOMINAL, *alone, supposed("quadratic cubic", predicted(0.0098)), one)
    assert verdict(made)[0] == expected


def test_every_verdict_but_consistent_and_missing_physics_has_a_reason_in_words():
    made = contest(NOMINAL, friction(0.6), maps={"velocity": predicted(1e-4)})
    assert decided(made)[1].reason
    assert decided(contest(NOMINAL), 0.8)[1].reason


def test_a_longer_delay_does_not_keep_an_effect_beside_it_from_being_named():
    late = supposed("input_delay.delay friction", predicted(0.01), "delay")
    alone = supposed("input_delay.delay", predicted(0.5), "delay")
    assert verdict(contest(NOMINAL, alone, late)) == ("missing_physics", ("friction",))


@pytest.mark.parametrize(("margin", "expected"), [(0.5, "undecided"), (30.0, "missing_physics")])
def test_a_name_is_stated_where_the_evidence_separates_it_from_others(margin, expected):
    score = 2000.0
    near = supposed("stribeck", predicted(0.3, score - margin))
    _, decision = decided(contest(NOMINAL, friction(0.2, score=score), near))
    assert decision.verdict == expected and decision.named == ("friction",)
    assert (decision.probability["friction"] >= 0.8) == (expected == "missing_physics")
    assert decision.probability["friction"] <= HOLDS


@pytest.mark.parametrize(("gain", "named"), [(5.0, ()), (20.0, ("friction",))])
def test_a_name_needs_a_gain_that_chance_among_all_candidates_does_not_bring(gain, named):
    nominal = supposed("", predicted(1.0, 0.0))
    _, decision = decided(contest(nominal, friction(0.1, score=gain)))
    assert decision.named == named


@pytest.mark.parametrize(
    ("both", "score", "named"),
    [
        (0.75, 600.0, ()),  # better than nothing, and hardly better than the first alone
        (0.6, 600.0, ("friction", "cubic")),
    ],
)
def test_two_effects_have_to_beat_the_best_one_alone_though_that_was_refused(both, score, named):
    alone = friction(0.9, score=500.0)
    pair = supposed("friction cubic", predicted(both, score))
    nominal = supposed("", predicted(1.0, 0.0))
    made = contest(nominal, alone, pair, maps={"position": predicted(0.01, -1000.0)})
    selection, _ = decided(made)
    assert set(selection.chosen.elements) == set(named)


@pytest.mark.parametrize(("score", "named"), [(3.0, ()), (300.0, ("friction", "cubic"))])
def test_two_effects_have_to_beat_the_nominal_model_where_one_alone_predicts_worse(score, named):
    alone = friction(0.9, score=-300.0)
    pair = supposed("friction cubic", predicted(0.1, score))
    selection, _ = decided(contest(supposed("", predicted(1.0, 0.0)), alone, pair))
    assert set(selection.chosen.elements) == set(named)
