"""The index page of a batch, looked at in a real browser."""

from pathlib import Path

import numpy as np
import pytest
from batches import made_up

from rhythmid.batch.present import present
from rhythmid.report.page import write_page

RUNS, DAY = 40, 86400.0


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory, browser) -> Path:
    """The page of forty runs of two rigs that differ."""
    folder = tmp_path_factory.mktemp("batch")
    values = np.random.default_rng(0).normal(size=RUNS) + 5.0 * (np.arange(RUNS) % 2)
    times = [1.7e9 + DAY * run for run in range(RUNS)]
    found = made_up(folder, values.tolist(), times, groups=("rig <A>", "rig B"))
    write_page(
        folder / "index.html",
        present(found, lambda task: f"answers/{task.file}.html", "rhythmid batch week.yaml"),
    )
    return folder / "index.html"


@pytest.mark.parametrize(("width", "dark"), [(1200, False), (1200, True), (390, False)])
def test_the_index_loads_without_errors_or_requests_and_fits_the_screen(
    browser, index: Path, width: int, dark: bool
) -> None:
    browser.open(index, width, dark)
    assert browser.messages == [] and browser.requests == [index.as_uri()]
    assert browser.evaluate("document.querySelector('h1').innerText") == "Not all parameters agree"
    assert browser.evaluate("document.documentElement.scrollWidth") <= width


def test_every_run_is_drawn_and_leads_to_its_report(browser, index: Path) -> None:
    browser.open(index, 1200)
    assert browser.evaluate("document.querySelectorAll('figure svg g title').length") == RUNS
    colours = "[...document.querySelectorAll('figure svg .dot')].map(dot => getComputedStyle(dot).fill)"
    assert browser.evaluate(f"new Set({colours}).size") == 2
    listed = "[...document.querySelectorAll('section')].filter(s => s.querySelector('h2').innerText == 'All answers')"
    assert browser.evaluate(f"{listed}[0].querySelectorAll('a[href^=\"answers/\"]').length") == RUNS
