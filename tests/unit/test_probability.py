"""Probabilities of names: shares of the evidence, times the chance that the catalogue holds the truth at all."""

import math
from dataclasses import replace

import numpy as np
import pytest
from contests import contest, decided, predicted, supposed
from hypothesis import given, settings
from hypothesis import strategies as st

from rhythmid.diagnose.constants import HOLDS, STATED
from rhythmid.diagnose.probability import (
    adequacy,
    joint_probability,
    resolved,
    weights_of,
)
from rhythmid.diagnose.selection import select
from rhythmid.diagnose.verdict import Decision

NOMINAL = supposed("", predicted(1.0))
SHARES = st.floats(0.0, 1.0)


@given(SHARES, SHARES)
def test_the_catalogue_is_the_more_adequate_the_more_the_names_explain(one, other):
    low, high = sorted((one, other))
    assert 0.0 <= adequacy(low) <= adequacy(high) <= 1.0


def test_names_that_explain_all_are_believed_and_such_that_explain_little_are_not():
    assert adequacy(1.0) == pytest.approx(HOLDS) and adequacy(0.5) < 0.5 and adequacy(0.0) < 0.1


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3))
def test_a_name_is_the_surer_the_better_the_size_of_its_effect_is_determined(one, other):
    low, high = sorted((one, other))
    assert 0.0 <= resolved(high) <= resolved(low) <= 1.0


def test_an_effect_is_stated_only_where_its_size_is_determined():
    made = contest(NOMINAL, supposed("a", predicted(0.1)))
    for error, stated in ((0.05, True), (0.6, False), (math.inf, False)):
        _, decision = decided(made, errors={"a": error})
        assert (decision.verdict == "missing_physics") == stated
        assert (decision.probability["a"] >= STATED) == stated


def test_a_small_effect_whose_size_is_open_leaves_the_large_one_stated():
    made = contest(NOMINAL, supposed("a", predicted(0.03)), supposed("a b", predicted(0.01)))
    _, decision = decided(made, errors={"b": 1.0})
    assert (decision.verdict, decision.named, decision.beside) == ("missing_physics", ("a",), ("b",))
    assert decided(made)[1].named == ("a", "b")


@settings(max_examples=30, deadline=None)
@given(
    st.dictionaries(st.sampled_from(["a", "b", "c", "a b", "a c", "b c"]), st.floats(0.01, 1.0), min_size=1)
)
def test_weights_sum_to_one_over_all_with_no_more_effects_than_the_chosen_one(left):
    made = contest(NOMINAL, *[supposed(elements, predicted(share)) for elements, share in left.items()])
    found = select(made)
    weights = weights_of(made, found)
    assert sum(weights.values()) == pytest.approx(1.0)
    assert all(len(key) <= len(found.chosen.elements) for key in weights)


def test_a_joint_probability_is_no_larger_than_that_of_any_of_its_names():
    pairs = [supposed(names, predicted(0.1, seed=i)) for i, names in enumerate(("a b", "a c", "b c"))]
    weights = {one.key: share for one, share in zip(pairs, (0.5, 0.3, 0.2))}
    made = contest(NOMINAL, *pairs)

    def joint(*names: str) -> float:
        return joint_probability(names, made, pairs[0], weights)

    assert joint("a") == pytest.approx(0.8) and joint("b") == pytest.approx(0.7)
    assert joint("a", "b") == joint("b", "a") == pytest.approx(0.5)
    assert joint("d") == 0.0


def test_a_richer_law_that_predicts_no_better_holds_the_name_that_it_contains():
    score = predicted(0.05).score
    plain = supposed("friction", predicted(0.05, score), richer={"friction": ("stribeck",)})
    wide = supposed("stribeck", predicted(0.0499, score + 0.1), free=9)
    _, decision = decided(contest(NOMINAL, plain, wide))
    assert (decision.verdict, decision.named) == ("missing_physics", ("friction",))
    assert decision.probability["friction"] > 0.8
    assert decision.equivalent == (("friction", "stribeck"),)
    unrelated = replace(plain, richer={})
    assert decided(contest(NOMINAL, unrelated, wide))[1].verdict == "undecided"


def test_a_name_that_every_likely_hypothesis_holds_is_sure_though_its_company_is_not():
    score = predicted(0.01).score
    pairs = [supposed(names, predicted(0.01, score, seed=i)) for i, names in enumerate(("a b", "a c"))]
    _, decision = decided(contest(NOMINAL, supposed("a", predicted(0.3)), *pairs))
    assert decision.probability["a"] > 0.9
    assert all(decision.probability[name] < 0.9 for name in decision.probability if name != "a")


@pytest.mark.parametrize("left", [0.02, 0.2, 0.4, 0.7])
def test_the_more_is_left_to_a_free_map_the_less_a_name_is_believed(left):
    def believed(rest: float) -> float:
        made = contest(NOMINAL, supposed("a", predicted(rest)), maps={"velocity": predicted(1e-4)})
        return decided(made)[1].probability["a"]

    assert believed(left) < believed(0.5 * left) <= 1.0


def test_no_probability_leaves_zero_to_one_and_none_of_the_names_tops_its_weight():
    _, decision = decided(contest(NOMINAL, supposed("a", predicted(0.1)), supposed("b", predicted(0.11))))
    for label, value in decision.probability.items():
        assert 0.0 <= value <= decision.weights[(label,)] + 1e-12


def beside_a_ripple(floor: float) -> Decision:
    """A cubic spring and a ripple, of which a free map leaves only `floor`."""
    made = contest(
        NOMINAL,
        supposed("cubic", predicted(0.09, 500.0)),
        supposed("cubic ripple", predicted(0.03, 900.0)),
        maps={"position": predicted(floor, 900.0 + 2e4 * (0.03 - floor))},
    )
    return decided(made)[1]


@pytest.mark.parametrize(("floor", "expected"), [(0.03, "missing_physics"), (0.001, "undecided")])
def test_what_effects_remove_that_are_hardly_true_counts_as_unexplained(floor, expected):
    # where a free map explains more beside it, the ripple is no law, so that the cubic spring leaves what it removes, too
    assert beside_a_ripple(floor).verdict == expected


def test_an_effect_is_as_doubtful_as_what_stands_beside_it_without_a_threshold():
    cubic = [beside_a_ripple(floor).probability["cubic"] for floor in np.linspace(0.001, 0.03, 30)]
    assert np.all(np.diff(cubic) > 0.0)
    assert np.max(np.diff(cubic)) < 0.05


@pytest.mark.parametrize(
    ("first", "both", "floor", "named"), [(0.011, 0.003, 1e-3, "a b"), (0.06, 0.03, 1e-3, "a")]
)
def test_a_second_effect_answers_for_its_share_of_what_small_effects_may_leave_and_for_all_beyond(
    first, both, floor, named
):
    # in both cases a free map removes a third or more of what the second effect removes
    made = contest(
        NOMINAL,
        supposed("a", predicted(first, 1000.0)),
        supposed("a b", predicted(both, 1500.0)),
        maps={"time": predicted(floor, 1600.0)},
    )
    decision = decided(made)[1]
    assert (decision.verdict, decision.named) == ("missing_physics", tuple(named.split()))


def test_an_effect_whose_company_is_in_doubt_is_doubted_where_not_all_companies_were_fitted():
    made = contest(
        NOMINAL,
        supposed("a", predicted(0.3)),
        supposed("b", predicted(0.9)),
        supposed("a b c", predicted(0.01)),
    )
    sure, doubted = (decided(made, errors={"b": error, "c": error})[1] for error in (0.01, 1.0))
    assert sure.named == ("a", "b", "c")
    assert doubted.probability["a"] < 0.7 * sure.probability["a"]
