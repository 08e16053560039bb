"""Options that take several values take them one after another, too."""

from rhythmid.cli import spread


def test_several_holdouts_may_follow_one_option():
    given = ["diagnose", "a", "b", "--holdout", "c", "d", "--model", "m.yaml", "--json", "out.json"]
    assert spread(given) == [
        "diagnose", "a", "b", "--holdout", "c", "--holdout", "d", "--model", "m.yaml", "--json", "out.json",
    ]  # fmt: skip


def test_arguments_without_such_options_are_left_alone():
    given = ["identify", "a", "b", "--json", "x.json"]
    assert spread(given) == given


def test_repeating_the_option_still_works():
    given = ["diagnose", "a", "--holdout", "c", "--holdout", "d"]
    assert spread(given) == given
