"""The table of verdicts: the first row that applies decides, and every verdict has a row."""

from dataclasses import replace
from typing import get_args

import pytest
from contests import NOMINAL, SEEN, SIZE, contest, decided, friction, predicted, supposed

from rhythmid.diagnose.hypothesis import Verdict
from rhythmid.diagnose.verdict_rules import VERDICT_RULES


@pytest.mark.parametrize("rule", VERDICT_RULES, ids=lambda rule: rule.name)
def test_the_first_row_of_the_table_of_verdicts_that_applies_decides(rule):
    late = supposed("input_delay.delay", predicted(0.01), "delay")
    moved = supposed("lag_of_the_sensor", predicted(0.01), "location")
    law = supposed("free_force_of_position", predicted(0.01), "free_map")
    mass = supposed("inertia.mass", predicted(0.01), "freed_value")
    pair = [supposed(name, predicted(0.1, 700.0, seed=i)) for i, name in enumerate("ab")]
    cases = {
        "none_yet": replace(contest(NOMINAL, maps={"velocity": predicted(0.1)}), cut_short=True),
        "not_searched": replace(contest(NOMINAL), cut_short=True, structured=0.5),
        "unnamed_remainder": contest(NOMINAL, maps={"velocity": predicted(0.1)}),
        "missed": contest(supposed("", predicted((0.5 * SIZE) ** 2))),
        "structured": replace(contest(NOMINAL), structured=1.0),
        "lost": replace(
            contest(supposed("", predicted(SIZE**2)), friction((0.8 * SIZE) ** 2)), structured_after=0.9
        ),
        "few_blocks": contest(
            supposed("", predicted(1.0, 0.0, mood=0.0)), supposed("friction", predicted(0.5, 4.2, mood=0.18))
        ),
        "nothing_missing": contest(NOMINAL),
        "freed_value": contest(NOMINAL, mass),
        "longer_delay": contest(NOMINAL, late),
        "one_law": contest(NOMINAL, law),
        "other_place": contest(NOMINAL, moved),
        "astray": replace(contest(NOMINAL, friction()), follows=0.05),
        "uncompared": replace(contest(NOMINAL, friction()), uncompared=True),
        "stated": contest(NOMINAL, friction()),
        "partly_left": contest(NOMINAL, friction(0.3), maps={"velocity": predicted(1e-4)}),
        "rivals": contest(NOMINAL, *pair),
        "size_open": contest(NOMINAL, friction()),
        "too_uncertain": contest(NOMINAL, friction(0.2), maps={"velocity": predicted(0.08)}),
    }
    made = cases.get(rule.name, contest(NOMINAL))
    errors = {"friction": 1.5} if rule.name == "size_open" else {}
    _, decision = decided(made, 0.8 if rule.name == "blind" else SEEN, errors)
    assert decision.verdict == rule.verdict
    beginning = rule.reason.partition("{")[0]
    assert decision.reason.startswith(beginning) and bool(decision.reason) == bool(rule.reason)


def test_every_verdict_has_a_row_and_names_of_rows_are_their_own():
    names = [rule.name for rule in VERDICT_RULES]
    assert len(set(names)) == len(names)
    assert {rule.verdict for rule in VERDICT_RULES} == set(get_args(Verdict))


def test_an_error_of_many_times_what_was_measured_is_told_without_its_figure():
    lost = replace(
        contest(supposed("", predicted((40.0 * SIZE) ** 2)), friction((39.0 * SIZE) ** 2)),
        structured_after=0.99,
    )
    decision = decided(lost)[1]
    assert decision.rule == "lost"
    assert (
        "misses more than 100 % of what was measured; more than 100 points of this error" in decision.reason
    )
