"""Campaigns: which cases, in which order, and what happens to a folder."""

from collections import Counter
from pathlib import Path

import pytest

from rhythmid.errors import InputError
from rhythmid.proof.campaign import SHARES, Campaign, Task, _shares, begin, carry_out
from rhythmid.proof.machines.designs import DESIGNS


def test_a_campaign_of_all_kinds_keeps_their_proportions():
    kinds = Counter(task.kind for task in Campaign(1, "all", 80).tasks)
    assert all(kinds[kind] == 10 * share for kind, share in SHARES.items())


def test_even_a_short_campaign_has_cases_of_every_kind():
    assert {task.kind for task in Campaign(1, "all", 8).tasks} == set(SHARES)


def test_a_longer_campaign_begins_with_the_cases_of_a_shorter_one():
    assert Campaign(1, "all", 20).tasks == Campaign(1, "all", 50).tasks[:20]


def test_no_case_is_drawn_twice():
    tasks = Campaign(1, "all", 100).tasks
    assert len(set(tasks)) == len(tasks)


def test_machines_take_turns_and_a_campaign_of_one_machine_has_the_same_cases():
    turns = Campaign(1, "single", 16).tasks
    assert [task.design for task in turns] == 2 * list(DESIGNS)
    alone = Campaign(1, "single", 2, machine="joint").tasks
    assert alone == [task for task in turns if task.design == "joint"]


def test_the_command_of_a_campaign_says_what_it_is():
    command = Campaign(7, "null", 12, "servo", cluttered=True, budget=30.0).command
    assert command == "rhythmid proof --kind null --machine servo --cluttered --budget 30 --cases 12 --seed 7"


def test_clean_and_cluttered_cases_of_one_number_differ_in_name_and_noise():
    clean, cluttered = (Campaign(1, "null", 1, cluttered=wanted).tasks[0] for wanted in (False, True))
    assert clean.name != cluttered.name and clean.stream != cluttered.stream


def test_a_campaign_is_not_begun_over_another(tmp_path: Path):
    begin(tmp_path / "out", Campaign(1, "single", 4), resume=False)
    with pytest.raises(InputError, match="--resume"):
        begin(tmp_path / "out", Campaign(1, "single", 4), resume=False)
    with pytest.raises(InputError, match="only --cases may change"):
        begin(tmp_path / "out", Campaign(2, "single", 4), resume=True)
    begin(tmp_path / "out", Campaign(1, "single", 8), resume=True)


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path):
    (tmp_path / "thesis.tex").write_text("draft")
    with pytest.raises(InputError, match="not empty"):
        begin(tmp_path, Campaign(1, "single", 4), resume=True)


def test_workers_share_the_processors_without_overlap():
    shares = _shares(1)
    assert len(shares) == 1
    two = _shares(2)
    if len(shares[0]) > 1:
        assert not set(two[0]) & set(two[1])
        assert sorted([*two[0], *two[1]]) == shares[0]


def test_cases_that_are_scored_are_not_done_again(tmp_path: Path):
    task = Task(1, "null", 0)
    folder = tmp_path / "cases" / task.name
    folder.mkdir(parents=True)
    (folder / "score.json").write_text("{}")
    assert carry_out(tmp_path, [task], 1, report=lambda news: pytest.fail("nothing was left to do")) == {}
