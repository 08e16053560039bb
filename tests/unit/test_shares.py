"""Shares of the mismatch: what each of several effects explains, whether they stand in for one another or mask one another."""

import pytest
from contests import NOMINAL, contest, decided, predicted, supposed


def test_an_effect_for_which_another_stands_in_keeps_its_share():
    alone = [supposed(name, predicted(ms)) for name, ms in (("gravity", 0.06), ("cubic", 0.08))]
    _, decision = decided(contest(NOMINAL, *alone, supposed("cubic gravity", predicted(0.001))))
    assert decision.shares["gravity"] == pytest.approx(0.5 * (0.94 + 0.079) / 0.999, abs=1e-3)
    assert sum(decision.shares.values()) == pytest.approx(1.0, abs=1e-6)


def test_an_effect_that_another_one_masks_keeps_the_share_that_it_has_beside_it():
    alone = [supposed("friction", predicted(0.4)), supposed("cubic", predicted(0.99))]
    _, decision = decided(contest(NOMINAL, *alone, supposed("cubic friction", predicted(0.001))))
    assert decision.shares["cubic"] == pytest.approx(0.399 / 0.999, abs=1e-3)


def test_a_share_is_not_that_of_the_nominal_model_where_the_model_without_the_effect_was_not_fitted():
    one = supposed("friction", predicted(0.2))
    three = supposed("friction cubic drag", predicted(0.01))
    _, decision = decided(contest(NOMINAL, one, three))
    assert max(decision.shares["cubic"], decision.shares["drag"]) < 0.2
