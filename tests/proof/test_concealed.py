"""The short form of the concealed proof: sealed cases, diagnosed from their bags, then opened.

Rates are measured by campaigns (`rhythmid proof`, docs/proof.md); these cases show that what a campaign does is done, and
that what it found of them still holds: clean machines with one effect, cluttered ones with none, and cluttered ones
whose effect the catalogue lacks. One runs always whose diagnosis takes seconds, and the others with `make test-long`.
That nothing is claimed of a machine that lacks nothing is in test_machines.py, too, and that the catalogue may lack a
law in tests/unit/test_history_map.py and tests/unit/test_effort_search.py.
"""

from pathlib import Path

import pytest

from rhythmid.proof.campaign import Campaign, Task, begin, carry_out, scores_in
from rhythmid.proof.card import markdown
from rhythmid.proof.score import Score

SHORT = [
    Task(60403, "single", 0, "pendulum"),
]
LONG = [
    *(Task(60403, "single", 0, design) for design in ("hopper", "servo", "axis", "joint")),
    *(Task(60402, "null", 0, design, cluttered=True) for design in ("servo", "pendulum", "motor")),
    *(Task(60405, "left-out", index, "axis", cluttered=True) for index in (0, 1)),
    Task(120405, "left-out", 2, "axis", cluttered=True),
]
LONGER = [pytest.param(LONG, id="long", marks=pytest.mark.long)]

pytestmark = pytest.mark.timeout(900)


@pytest.fixture(
    scope="module",
    params=[pytest.param(SHORT, id="short"), *LONGER],
)
def scores(request, tmp_path_factory) -> list[Score]:
    out: Path = tmp_path_factory.mktemp("proof") / "out"
    tasks: list[Task] = request.param
    begin(out, Campaign(tasks[0].seed, "all", len(tasks)), resume=False)
    failures = carry_out(out, tasks, jobs=2, report=lambda news: None)
    assert not failures
    told = (out / "seals.txt").read_text().splitlines()
    assert len(told) == len(tasks)
    found = scores_in(out, tasks)
    assert len(found) == len(tasks)
    print(markdown(found, "pytest tests/proof"))
    return found


def _of(scores: list[Score], kind: str) -> list[Score]:
    return [one for one in scores if one.kind == kind]


def test_no_diagnosis_fails(scores):
    assert [one.failure for one in scores if one.failure] == []


def test_concealed_effects_are_named(scores):
    singles = _of(scores, "single")
    wrong = [(one.case, one.true, one.verdict, one.named) for one in singles if one.outcome != "exact"]
    assert singles and not wrong


@pytest.mark.parametrize("scores", LONGER, indirect=True)  # such cases are among these only
def test_where_nothing_is_concealed_nothing_is_claimed(scores):
    nulls = _of(scores, "null")
    assert nulls
    assert [(one.case, one.verdict, one.named) for one in nulls if one.false_alarm] == []


@pytest.mark.parametrize("scores", LONGER, indirect=True)
def test_what_the_catalogue_lacks_gets_no_confident_name(scores):
    lacking = _of(scores, "left-out")
    assert lacking
    assert [(one.case, one.true, one.named) for one in lacking if not one.honest] == []


def test_named_effects_bring_the_held_out_error_down_to_the_noise(scores):
    moved = [
        one for one in _of(scores, "single") if one.heldout is not None
    ]  # the others are scored by their effort
    assert moved and all(one.heldout <= 1.1 for one in moved), [(one.case, one.heldout) for one in moved]
