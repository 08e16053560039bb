"""Chances of laws: what real machines are known to have counts beside what the records show."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.diagnose.constants import HOLDS, PRIOR_ODDS
from rhythmid.diagnose.probability import chance_of_law, prior_odds

SHARES = st.floats(0.01, 1.0)


@given(SHARES, SHARES)
def test_with_the_same_evidence_a_law_of_friction_is_likelier_than_one_of_another_family(share, left):
    friction, stiffness = (chance_of_law(share, left, family=one) for one in ("friction", "stiffness"))
    assert stiffness == chance_of_law(share, left) < friction


@given(SHARES, st.sampled_from(["friction", "lag", "stiffness"]))
def test_odds_of_a_law_are_those_of_the_evidence_times_the_prior_odds_of_its_family(share, family):
    without, chance = chance_of_law(share, 0.1), chance_of_law(share, 0.1, family=family)
    assert chance / (1.0 - chance) == pytest.approx(prior_odds(family) * without / (1.0 - without))


def test_prior_odds_are_those_of_the_table_and_one_for_other_families():
    assert prior_odds("friction") == PRIOR_ODDS["friction"]
    assert prior_odds("lag") == prior_odds("") == 1.0 and chance_of_law(1.0, 0.0) == pytest.approx(HOLDS)
