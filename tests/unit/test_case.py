"""A case's budget: seconds in which an answer is due, of which a search has a share."""

import math
import time

import pytest

from rhythmid.diagnose.case import SEARCHED, Budget


def test_a_budget_without_seconds_is_never_spent():
    assert not Budget(None, began=time.monotonic() - 1e9).spent


def test_a_budget_is_spent_once_the_share_of_the_search_is_over_and_not_before():
    assert not Budget(1000.0).spent
    assert Budget(10.0, began=time.monotonic() - 1.01 * SEARCHED * 10.0).spent
    assert not Budget(10.0, began=time.monotonic() - 5.0).spent


def test_a_share_of_a_budget_ends_so_long_after_its_beginning_but_not_before_the_least():
    budget = Budget(10.0, began=100.0)
    assert budget.at(0.5) == pytest.approx(105.0)
    assert budget.at(0.5, least=7.0) == pytest.approx(107.0)
    assert Budget(None).at(0.5, least=7.0) == math.inf


def test_a_budget_begins_when_it_is_made():
    first = Budget(1.0)
    assert first.began <= Budget(1.0).began <= time.monotonic()
