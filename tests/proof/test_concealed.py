"""The short form of the concealed proof: fifteen sealed cases, diagnosed from their bags, then opened.

The promises are rates (97 % named, 1 % false alarms, 90 % of unknown effects not misnamed), and fifteen cases scatter about
them. Each bound below leaves so much slack that a program which just keeps its promise fails it in less than one of a
hundred draws (binomially); one that names two thirds of the effects fails it in nine of ten.
"""

from pathlib import Path

import pytest

from rhythmid.proof.campaign import Campaign, Task, begin, carry_out, scores_in
from rhythmid.proof.card import markdown
from rhythmid.proof.score import Score

SEED = 2024
SINGLES, NULLS, LEFT_OUT = 10, 3, 2
NAMED_AT_LEAST = 8  # P(fewer of 10 | 97 %) = 0.3 %
EXACT_AT_LEAST = 7  # P(fewer of 10 | 92 %) = 0.6 %
ALARMS_AT_MOST = 1  # P(more of 3 | 1 %) = 0.03 %
HONEST_AT_LEAST = 1  # P(fewer of 2 | 90 %) = 1 %

pytestmark = [pytest.mark.last, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def scores(tmp_path_factory) -> list[Score]:
    out: Path = tmp_path_factory.mktemp("proof") / "out"
    begin(out, Campaign(SEED, "all", SINGLES + NULLS + LEFT_OUT, "hopper"), resume=False)
    tasks = [  # the longest first, so that neither job ends long after the other
        *(Task(SEED, "left-out", index) for index in range(LEFT_OUT)),
        *(Task(SEED, "single", index) for index in range(SINGLES)),
        *(Task(SEED, "null", index) for index in range(NULLS)),
    ]
    failures = carry_out(out, tasks, jobs=2, report=lambda news: None)
    assert not failures
    told = (out / "seals.txt").read_text().splitlines()
    assert len(told) == len(tasks)
    found = scores_in(out, tasks)
    print(markdown(found, "pytest tests/proof"))
    return found


def _of(scores: list[Score], kind: str) -> list[Score]:
    return [one for one in scores if one.kind == kind]


def test_no_diagnosis_fails(scores):
    assert [one.failure for one in scores if one.failure] == []


def test_concealed_effects_are_named(scores):
    singles = _of(scores, "single")
    wrong = [(one.case, one.true, one.verdict, one.named) for one in singles if not one.right_within_family]
    assert len(singles) - len(wrong) >= NAMED_AT_LEAST, wrong
    assert sum(one.outcome == "exact" for one in singles) >= EXACT_AT_LEAST, wrong


def test_where_nothing_is_concealed_nothing_is_claimed(scores):
    alarms = [(one.case, one.verdict, one.named) for one in _of(scores, "null") if one.false_alarm]
    assert len(alarms) <= ALARMS_AT_MOST, alarms


def test_what_the_catalogue_lacks_gets_no_confident_name(scores):
    dishonest = [(one.case, one.true, one.named) for one in _of(scores, "left-out") if not one.honest]
    assert LEFT_OUT - len(dishonest) >= HONEST_AT_LEAST, dishonest


def test_named_effects_bring_the_held_out_error_down_to_the_noise(scores):
    named = [one for one in _of(scores, "single") if one.outcome == "exact"]
    above = [(one.case, one.heldout) for one in named if one.heldout is None or one.heldout > 1.1]
    assert len(above) <= 1, above
