"""A case's budget: seconds after which nothing more is begun."""

import time

from rhythmid.diagnose.case import Budget


def test_a_budget_without_seconds_is_never_spent():
    assert not Budget(None, began=time.monotonic() - 1e9).spent


def test_a_budget_is_spent_once_its_seconds_are_over_and_not_before():
    assert not Budget(1000.0).spent
    assert Budget(10.0, began=time.monotonic() - 11.0).spent
    assert not Budget(10.0, began=time.monotonic() - 5.0).spent


def test_a_budget_begins_when_it_is_made():
    first = Budget(1.0)
    assert first.began <= Budget(1.0).began <= time.monotonic()
