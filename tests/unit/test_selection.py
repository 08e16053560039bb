"""Selection: effects are granted their places one after the other, and whatever speaks against others is told."""

import math
from dataclasses import replace

import pytest
from contests import contest, ends, predicted, supposed
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.diagnose.selection import equivalent, select, special_case

NOMINAL = supposed("", predicted(1.0))
FRICTION = supposed("friction", predicted(0.2))
CUBIC = supposed("cubic", predicted(0.6))
BOTH = supposed("friction cubic", predicted(0.01))


def test_places_are_granted_from_the_nominal_model_on():
    found = select(contest(NOMINAL, CUBIC, FRICTION, BOTH))
    assert found.chosen is BOTH


def test_the_chosen_hypothesis_is_rejected_by_no_rule_and_every_other_reason_is_told():
    faint = supposed("drag", predicted(0.999))
    found = select(contest(NOMINAL, CUBIC, FRICTION, faint, BOTH))
    rejected = {row.hypothesis for row in found.rejections}
    assert ("drag",) in rejected and found.chosen.elements not in rejected
    assert all(row.statistic < row.threshold and row.reason for row in found.rejections)


def test_a_place_that_is_not_granted_ends_the_growth_and_larger_hypotheses_are_still_judged():
    useless = supposed("friction drag", predicted(0.1999, FRICTION.prediction.score))
    three = supposed("friction drag cubic", predicted(0.2, FRICTION.prediction.score - 10.0))
    found = select(contest(NOMINAL, FRICTION, useless, three))
    assert found.chosen is FRICTION
    assert {row.hypothesis for row in found.rejections} == {useless.elements, three.elements}


def test_what_has_lost_its_shape_leaves_its_place_to_the_next_best():
    lost = supposed("play", predicted(0.05), shape={"within_bounds": 0.0})
    found = select(contest(NOMINAL, lost, FRICTION))
    assert found.chosen is FRICTION
    assert [row.name for row in found.rejections if row.hypothesis == ("play",)] == ["within_bounds"]


@pytest.mark.parametrize("kind", ["freed_value", "delay", "location", "free_map"])
def test_other_kinds_of_explanation_compete_for_the_same_place(kind):
    other = supposed("other", predicted(0.01), kind)
    assert select(contest(NOMINAL, FRICTION, other)).chosen is other
    assert select(contest(NOMINAL, FRICTION, supposed("other", predicted(0.5), kind))).chosen is FRICTION


def test_of_hypotheses_that_predict_alike_the_one_with_fewer_free_parameters_is_chosen():
    score = FRICTION.prediction.score
    wide = supposed("stribeck", predicted(0.2, score + 0.5), free=9)
    assert select(contest(NOMINAL, wide, FRICTION)).chosen is FRICTION


def test_of_laws_that_predict_alike_the_special_case_is_chosen_and_not_the_one_that_contains_it():
    score = FRICTION.prediction.score
    plain = supposed("friction", predicted(0.2, score), richer={"friction": ("stribeck", "asymmetric")})
    wide = supposed("stribeck", predicted(0.1999, score + 0.1), free=plain.free - 1)
    assert special_case(plain, wide) and not special_case(wide, plain)
    assert select(contest(NOMINAL, plain, wide)).chosen is plain
    clear = supposed("stribeck", predicted(0.01), free=9)
    assert select(contest(NOMINAL, plain, clear)).chosen is clear


def test_predictions_that_are_the_same_are_equivalent():
    one = supposed("wide", FRICTION.prediction, free=9)
    assert equivalent(one, FRICTION, contest(NOMINAL, one, FRICTION, practical=0.0))
    assert select(contest(NOMINAL, one, FRICTION)).chosen is FRICTION


def test_a_rival_is_equivalent_where_the_data_do_not_decide():
    best = supposed("a", predicted(0.1, 100.0, seed=1))
    near, far = supposed("b", predicted(0.11, 99.0, mood=1.0, seed=2)), supposed("d", predicted(0.101, 50.0))
    every = contest(NOMINAL, best, near, far)
    assert equivalent(near, best, every) and not equivalent(far, best, every)


def test_a_rival_that_leaves_much_more_of_the_mismatch_is_not_equivalent_though_it_predicts_most_blocks_better():
    best = supposed("stop", predicted(0.1, 100.0, seed=1))
    density = best.prediction.log_density + 5.0
    density[:2] -= 500.0  # where the stop is hit
    error = 0.9 * best.prediction.squared_error
    error[:20] *= 5.0
    other = supposed("friction", replace(best.prediction, log_density=density, squared_error=error))
    assert not equivalent(other, best, contest(NOMINAL, best, other))


@pytest.mark.parametrize(
    ("left", "floor", "same"), [(0.101, 1e-6, True), (0.1005, 0.1, True), (0.2, 0.1, False)]
)
def test_a_special_case_is_equivalent_but_for_a_small_share_of_what_it_leaves_or_of_the_mismatch(
    left, floor, same
):
    richer = supposed("stribeck", predicted(0.1, 200.0))
    plain = supposed("friction", predicted(left, 50.0), richer={"friction": ("stribeck",)})
    other = replace(plain, richer={})
    maps = {"velocity": predicted(floor, 0.0)}
    assert equivalent(plain, richer, contest(NOMINAL, plain, richer, maps=maps)) == same
    assert not equivalent(other, richer, contest(NOMINAL, other, richer, maps=maps))


def test_a_richer_law_replaces_one_that_it_contains_by_its_share_of_the_mismatch_however_little_noise_there_is():
    for left, gain, same in ((0.115, 1000.0, True), (0.13, 1000.0, False), (0.13, 2.0, True)):
        richer = supposed("stribeck", predicted(0.1, 50.0 + gain))
        plain = supposed("friction", predicted(left, 50.0), richer={"friction": ("stribeck",)})
        assert equivalent(plain, richer, contest(NOMINAL, plain, richer)) == same


def test_a_law_that_replaces_a_simpler_one_is_not_passed_over_because_another_predicts_more_blocks_better():
    richer = {"coulomb": ("asymmetric", "stribeck")}
    plain = supposed("coulomb", predicted(0.06, 500.0), richer=richer)
    asymmetric = supposed(
        "asymmetric", predicted(0.055, 750.0), free=9
    )  # removes too little of what the plain one leaves
    stribeck = supposed("stribeck", predicted(0.01, 720.0), free=9)
    assert select(contest(NOMINAL, plain, asymmetric)).chosen is plain
    assert select(contest(NOMINAL, plain, asymmetric, stribeck)).chosen is stribeck


def test_where_the_simplest_of_several_that_predict_alike_is_refused_another_is_granted():
    best = supposed("a", predicted(0.1, 80.0, seed=1), free=9)
    plain = supposed("b", predicted(0.1, 79.0, seed=1), shape={"within_bounds": math.inf})
    lost = replace(plain, shape={"within_bounds": 0.0})
    assert select(contest(NOMINAL, best, plain)).chosen is plain
    assert select(contest(NOMINAL, best, lost)).chosen is best
    small = supposed("b", predicted(0.999, 79.0, seed=1))  # as probable, and of no practical size
    assert select(contest(NOMINAL, best, small)).chosen is best


@settings(max_examples=40, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(["a", "b", "c", "a b", "a c", "b c", "a b c"]),
        st.floats(1e-3, 1.0),
        max_size=7,
    ),
    st.randoms(use_true_random=False),
)
def test_a_selection_does_not_depend_on_the_order_of_the_hypotheses(left, random):
    made = [supposed(elements, predicted(share)) for elements, share in left.items()]
    shuffled = random.sample(made, len(made))
    one, other = (select(contest(NOMINAL, *every)) for every in (made, shuffled))
    assert one.chosen.key == other.chosen.key
    assert set(one.rejections) == set(other.rejections)


def test_two_effects_that_mask_one_another_are_granted_together():
    alone = supposed("a", predicted(0.99, 0.5, seed=3))
    together = supposed("a b", predicted(0.01, 300.0, seed=3))
    chosen = select(contest(NOMINAL, alone, together))
    assert chosen.chosen is together


def test_a_third_effect_does_not_bring_in_a_second_that_was_refused():
    # "b" beside "a" predicts well but for the held-out end; a delay that changes nothing comes with both of them
    one, two = supposed("a", predicted(0.2)), predicted(0.1)
    nominal = supposed("", ends(predicted(1.0), 0.0, mood=0.0))
    first = supposed("a", ends(one.prediction, 10.0, mood=0.0))
    second, late = (supposed(names, ends(two, 8.0)) for names in ("a b", "a b delay"))
    plain = supposed("a c", ends(predicted(0.19), 5.0), free=5)
    assert select(contest(nominal, first, second, plain, late)).chosen.elements == ("a",)


def test_a_second_effect_that_adds_nothing_to_a_refused_one_is_not_granted_with_it():
    alone = supposed("a", predicted(0.2, 100.0, mood=60.0, seed=3))
    together = supposed("a b", predicted(0.19, 101.0, mood=60.0, seed=4))
    assert select(contest(NOMINAL, alone, together)).chosen.elements == ()


def test_the_floor_is_the_best_prediction_of_all_free_maps_included():
    assert contest(NOMINAL, FRICTION).floor == pytest.approx(0.2)
    assert contest(NOMINAL, FRICTION, maps={"time": predicted(0.05)}).floor == pytest.approx(0.05)
