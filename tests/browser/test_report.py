"""The report of a real diagnosis, looked at in a real browser."""

from pathlib import Path

import pytest
from axes import axis, axis_model
from legible import DRAWINGS, FAINT, OVER_THE_EDGE

from rhythmid.diagnose.answer.present import present
from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.experiment import Experiment
from rhythmid.identify.identify import paper_hopper
from rhythmid.offline_run import perform
from rhythmid.record.record import Channel, Record
from rhythmid.report.page import write_page

CANDIDATES = {"coulomb_friction", "cubic_stiffness", "flight_damping", "sensor_lag"}
SECTIONS = (
    "Where model and machine differ", "What is missing", "How much better it fits", "What is left unexplained",
    "Harmonics of the cycle and transfer functions", "The hypotheses", "Rejected hypotheses, and why", "Parameters", "Delays", "What remains unknown",
    "The next experiment", "Calibration", "What was assumed",
    "Quality of the records", "How to reproduce this",
)  # fmt: skip
EXPERIMENT = """
model: machine.yaml
excitation: {{type: chirp, amplitude: {amplitude}, band: [0, 7], sweep: 6.0}}
forcing: {{amplitude: 1.0, frequency: 1.0}}
delays: {{input: 0.0203, measurement: 0.0151}}
noise: {{measurement_std: 1.0e-4}}
seed: {seed}
"""


def record(folder: Path, name: str, amplitude: float, seed: int) -> Record:
    """A record of the hopper with hidden friction."""
    path = folder / f"{name}.yaml"
    path.write_text(EXPERIMENT.format(amplitude=amplitude, seed=seed))
    messages = perform(Experiment.load(path))
    output, command, forcing = (messages[topic] for topic in ("joint_states", "excitation", "forcing"))
    return Record(
        name,
        Channel(output.stamp_ns * 1e-9, output.position, "m"),
        Channel(command.stamp_ns * 1e-9, command.effort, "N"),
        Channel(forcing.stamp_ns * 1e-9, forcing.effort, "N"),
    )


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, browser) -> Path:
    """The page of a quick diagnosis; not made where there is no browser to look at it."""
    folder = tmp_path_factory.mktemp("report")
    catalogue = load_catalogue()
    machine = paper_hopper().with_element(catalogue["coulomb_friction"], {"force": 0.03})
    machine.save(folder / "machine.yaml")
    records = [record(folder, "weak chirp", 0.2, 1), record(folder, "strong chirp", 1.2, 2)]
    holdout = [record(folder, "other chirp", 0.5, 3)]
    others = [name for name, element in catalogue.items() if element.candidate and name not in CANDIDATES]
    few = catalogue.without(*others)
    nominal = paper_hopper().with_values({"linear_spring.stiffness": 190.0})
    answer = diagnose(records, nominal, holdout, few)
    assert answer.diagnosis.verdict == "missing_physics"
    path = folder / "report.html"
    write_page(path, present(answer, nominal, records, holdout, "rhythmid diagnose bags", "nominal.yaml"))
    return path


@pytest.mark.parametrize(("width", "dark"), [(1200, False), (1200, True), (390, False)])
def test_the_page_loads_without_errors_or_requests(browser, report: Path, width: int, dark: bool) -> None:
    browser.open(report, width, dark)
    assert browser.messages == []
    assert browser.requests == [report.as_uri()]
    assert browser.evaluate("document.querySelector('h1').innerText") == "Missing physics: Coulomb friction"


def test_all_sections_are_there_and_visible(browser, report: Path) -> None:
    browser.open(report, 1200)
    titles = browser.evaluate("[...document.querySelectorAll('main h2')].map(h => h.innerText)")
    assert tuple(titles) == SECTIONS
    assert browser.evaluate(
        "[...document.querySelectorAll('section')].every(s => s.getBoundingClientRect().height > 50)"
    )


@pytest.mark.parametrize("width", [320, 390, 768, 1200])
def test_nothing_runs_over_the_edge(browser, report: Path, width: int) -> None:
    browser.open(report, width)
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert browser.evaluate(OVER_THE_EDGE) == []


def test_a_report_by_effort_stays_within_the_page_too(browser, tmp_path: Path) -> None:
    catalogue = load_catalogue()
    others = [
        n for n, e in catalogue.items() if e.candidate and n not in ("coulomb_friction", "quadratic_drag")
    ]
    answer = diagnose([axis()], axis_model(), [axis(1)], catalogue.without(*others))
    path = tmp_path / "effort.html"
    write_page(
        path, present(answer, axis_model(), [axis()], [axis(1)], "rhythmid diagnose bags", "axis.yaml")
    )
    for width in (320, 1200):
        browser.open(path, width)
        assert browser.messages == []
        assert (
            browser.evaluate("document.querySelector('h1').innerText") == "Missing physics: Coulomb friction"
        )
        browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
        assert browser.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", [390, 1200])
def test_every_drawing_is_drawn_and_its_text_stays_inside_and_legible(
    browser, report: Path, width: int
) -> None:
    browser.open(report, width)
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    browser.evaluate("document.querySelector('.drawings').click()")
    assert browser.evaluate("[...document.images].every(i => i.complete && i.naturalWidth > 0)")
    drawn = browser.evaluate(DRAWINGS)
    assert len(drawn) >= 12
    for one in drawn:
        assert one["width"] > 250 and one["height"] > 50, one
        assert one["outside"] == 0, one
        assert one["size"] >= 9.0, one
        assert one["touching"] == [], one


def test_the_faulty_slot_is_marked_in_the_path_that_is_shown(browser, report: Path) -> None:
    for width in (1200, 390):
        browser.open(report, width)
        shown = browser.evaluate(
            "[...document.querySelectorAll('.slot.faulty')].filter(s => s.checkVisibility()).map(s =>"
            " [...s.parentNode.querySelectorAll('.missing')].map(t => t.textContent))"
        )
        assert shown == [["+ Coulomb friction"]]


@pytest.mark.parametrize("dark", [False, True])
def test_text_stands_out_from_its_background(browser, report: Path, dark: bool) -> None:
    """WCAG 2.1, success criterion 1.4.3: a contrast of at least 4.5 for text, drawings' text included."""
    browser.open(report, 1200, dark)
    assert browser.evaluate(FAINT) == []


def test_in_print_everything_folded_is_unfolded(browser, report: Path) -> None:
    browser.open(report, 800, medium="print")
    assert browser.evaluate(
        "[...document.querySelectorAll('details')].every(d => d.getBoundingClientRect().height > 100"
        " || d.querySelectorAll('figure, pre, li, tr').length < 3)"
    )
    assert not browser.evaluate("[...document.querySelectorAll('.live')].some(e => e.checkVisibility())")
    assert browser.evaluate(
        "[...document.querySelectorAll('.enlivened > svg')].every(s => getComputedStyle(s).display === 'block')"
    )
    assert browser.print().startswith(b"%PDF")


def test_the_page_stays_small(report: Path) -> None:
    assert report.stat().st_size < 2_000_000
