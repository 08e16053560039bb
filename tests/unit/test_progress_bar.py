"""The bar on the terminal shows what is known: what is under way, since when, and how much of a budget is spent."""

import io
import time

import pytest
from rich.console import Console
from rich.progress import Progress

from rhythmid import progress_bar
from rhythmid.progress import counted
from rhythmid.progress_bar import SpentColumn, progress, spent_words


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


def test_work_of_many_parts_tells_now_and_then_how_long_the_rest_takes():
    clock, told = [0.0], []

    def parts():
        for part in range(20):
            clock[0] += 3.0
            yield part

    assert list(counted(parts(), 20, "records", told.append, lambda: clock[0])) == list(range(20))
    assert told[:2] == ["records: 2 of 20 done, about 54 s left", "records: 4 of 20 done, about 48 s left"]
    assert len(told) == 9


def test_nothing_is_printed_where_there_is_no_log_and_no_terminal():
    console = Console(file=io.StringIO())
    with progress(console, log=False) as tell:
        tell("reading")
    assert isinstance(console.file, io.StringIO) and console.file.getvalue() == ""


def test_a_step_that_takes_long_is_told_again_where_no_line_shows_the_time(monkeypatch):
    monkeypatch.setattr(progress_bar, "SILENT", 0.02)
    console = Console(file=io.StringIO(), width=120)
    with progress(console) as tell:
        tell("scoring the catalogue")
        time.sleep(0.3)
    assert isinstance(console.file, io.StringIO)
    lines = console.file.getvalue().splitlines()
    assert lines[0].endswith(" s  scoring the catalogue") and len(lines) > 1
    assert all(line.endswith(" s  still scoring the catalogue") for line in lines[1:])
