"""The bar on the terminal shows what is known: what is under way, since when, and how much of a budget is spent."""

import io

import pytest
from rich.console import Console
from rich.progress import Progress

from rhythmid.progress import Step
from rhythmid.progress_bar import SpentColumn, left_words, progress, spent_words


def test_what_begins_is_printed_with_its_time_and_markup_in_it_stays_text():
    console = Console(file=io.StringIO(), width=120)
    with progress(console) as tell:
        tell("refitting with [red]lags[/]")
    assert isinstance(console.file, io.StringIO)
    assert "s  refitting with [red]lags[/]" in console.file.getvalue()


@pytest.mark.parametrize(
    ("elapsed", "words"),
    [
        (0.0, "0 % of 20 s spent"),
        (5.0, "25 % of 20 s spent"),
        (20.0, "20 s spent; finishing"),
        (31.0, "20 s spent; finishing"),
    ],
)
def test_a_budget_is_told_by_the_share_that_is_spent(elapsed, words):
    assert spent_words(elapsed, 20.0) == words


def test_the_bar_is_as_long_as_the_share_that_is_spent_and_never_longer():
    clock = [0.0]
    bar = Progress(get_time=lambda: clock[0], auto_refresh=False)
    bar.add_task("")
    (task,) = bar.tasks
    for clock[0], completed in ((0.0, 0.0), (5.0, 5.0), (31.0, 20.0)):
        shown = SpentColumn(20.0).render(task)
        assert (shown.total, shown.completed) == (20.0, completed)


def test_a_line_with_a_budget_shows_it():
    console = Console(file=io.StringIO(), width=160, force_terminal=True)
    with progress(console, 1000.0) as tell:
        tell("scoring the catalogue")
    assert isinstance(console.file, io.StringIO)
    assert "0 % of 1000 s spent" in console.file.getvalue()


@pytest.mark.parametrize(
    ("done", "total", "elapsed", "words"),
    [
        (0, 9, 4.0, "0 of 9"),
        (3, 9, 12.0, "3 of 9, about 24 s left"),
        (1, 9, 60.0, "1 of 9, about 8 min left"),
        (9, 9, 36.0, "9 of 9"),
    ],
)
def test_countable_work_says_how_long_the_rest_will_take(done, total, elapsed, words):
    assert left_words(done, total, elapsed) == words


def test_the_line_shows_what_is_left_of_countable_work():
    console = Console(file=io.StringIO(), width=160, force_terminal=True)
    with progress(console, log=False) as tell:
        tell(Step("refitting", 1, 4))
    assert isinstance(console.file, io.StringIO)
    assert "refitting: 1 of 4" in console.file.getvalue()


@pytest.mark.parametrize("interactive", [True, False])
def test_parts_of_one_work_are_printed_once(interactive):
    console = Console(file=io.StringIO(), width=160, force_terminal=interactive)
    with progress(console) as tell:
        for done in range(4):
            tell(Step("refitting", done, 4))
        tell("weighing")
    assert isinstance(console.file, io.StringIO)
    printed = [line for line in console.file.getvalue().splitlines() if " s  " in line]
    assert sum("s  refitting" in line for line in printed) == 1
    assert sum("s  weighing" in line for line in printed) == 1


def test_nothing_is_printed_where_there_is_no_log_and_no_terminal():
    console = Console(file=io.StringIO())
    with progress(console, log=False) as tell:
        tell("reading")
    assert isinstance(console.file, io.StringIO) and console.file.getvalue() == ""
