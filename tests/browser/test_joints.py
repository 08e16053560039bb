"""The report of a machine of several joints, looked at in a real browser."""

from dataclasses import replace
from pathlib import Path

import pytest
from legged import MODELS, fixed_leg
from legible import DRAWINGS, FAINT, OVER_THE_EDGE

from rhythmid.body.joint_experiment import JointExperiment, perform
from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.diagnose.joints.joint_present import present_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.joints.joint_identification import identify_machine
from rhythmid.identify.joints.joint_present import present_identified
from rhythmid.record.joint_messages import write_joint_bag
from rhythmid.record.joint_record import load_joint_records
from rhythmid.report.page import write_page


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, browser) -> Path:
    """The page of a leg whose knee has friction that the model lacks; not made where there is no browser to look at it."""
    folder = tmp_path_factory.mktemp("joints")
    catalogue = load_catalogue()
    nominal = Machine.load(fixed_leg(folder), catalogue)
    path, knee, rest = (folder / "leg.yaml").read_text().partition("knee:")
    friction = "force: [{coulomb_friction: {force: 0.3, transition: 0.02}}, "
    (folder / "rough.yaml").write_text(path + knee + rest.replace("force: [", friction, 1))
    run = (MODELS / "leg_experiment.yaml").read_text().replace("start: {rail: 0.45}", "")
    (folder / "run.yaml").write_text(run.replace("12.0 ", "8.0 ").replace("rate: 500", "rate: 1000"))
    signals = (MODELS / "leg_signals.yaml").read_text()
    (folder / "signals.yaml").write_text(signals[: signals.index("base:")])
    made = perform(Machine.load(folder / "rough.yaml", catalogue), JointExperiment.load(folder / "run.yaml"))
    write_joint_bag(folder / "bag", {topic: (made.stamp_ns, *rest) for topic, rest in made.topics.items()})
    records = load_joint_records([folder / "bag"], folder / "signals.yaml")
    answer = diagnose_machine(records, nominal, [], catalogue)
    page = folder / "report.html"
    write_page(page, present_machine(answer, nominal, "leg.yaml with bag", "rhythmid diagnose bag"))
    fitted = replace(identify_machine(records, nominal, free=False), not_identified=("knee",))
    write_page(folder / "identified.html", present_identified(fitted, nominal, "leg.yaml with bag"))
    return page


@pytest.mark.parametrize(("width", "dark"), [(1200, False), (1200, True), (390, False), (320, False)])
def test_the_page_loads_by_itself_and_fits_the_screen(browser, report: Path, width: int, dark: bool) -> None:
    browser.open(report, width, dark)
    assert browser.messages == [] and browser.requests == [report.as_uri()]
    assert (
        browser.evaluate("document.querySelector('h1').innerText")
        == "Missing physics: Coulomb friction at knee"
    )
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert browser.evaluate(OVER_THE_EDGE) == []
    assert browser.evaluate(FAINT) == []


@pytest.mark.parametrize("width", [390, 1200])
def test_the_robot_and_the_efforts_are_drawn_and_legible(browser, report: Path, width: int) -> None:
    browser.open(report, width)
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    browser.evaluate("document.querySelector('.drawings').click()")
    drawn = browser.evaluate(DRAWINGS)
    assert len(drawn) >= 3
    for one in drawn:
        assert one["width"] > 250 and one["height"] > 50, one
        assert one["outside"] == 0 and one["touching"] == [], one
        assert one["size"] >= 9.0, one


@pytest.mark.parametrize(("width", "dark"), [(1200, True), (320, False)])
def test_the_page_of_an_identification_fits_the_screen_and_marks_what_is_not_identified(
    browser, report: Path, width: int, dark: bool
) -> None:
    page = report.parent / "identified.html"
    browser.open(page, width, dark)
    assert browser.messages == [] and browser.requests == [page.as_uri()]
    assert browser.evaluate("document.querySelector('h1').innerText") == "Not identified: knee"
    assert browser.evaluate("document.querySelectorAll('.slot.faulty').length") == 1
    browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert browser.evaluate(OVER_THE_EDGE) == []
    assert browser.evaluate(FAINT) == []
    browser.evaluate("document.querySelector('.drawings').click()")
    for one in browser.evaluate(DRAWINGS):
        assert one["outside"] == 0 and one["touching"] == [], one
    figures = browser.evaluate("[...document.querySelectorAll('figure')].map(f => f.innerText)")
    for joint in ("hip", "knee"):
        for title in (
            f"Effort at {joint}",
            f"Measured against predicted at {joint}",
            f"What is left at {joint} over frequency",
        ):
            assert any(title in one for one in figures), title
    assert sum("Correlation of the parameters" in one for one in figures) == 2


def test_the_faulty_joint_alone_is_marked(browser, report: Path) -> None:
    browser.open(report, 1200)
    assert browser.evaluate("document.querySelectorAll('.slot.faulty').length") == 1
    marked = browser.evaluate("[...document.querySelectorAll('tr.marked')].map(r => r.cells[0].innerText)")
    assert marked == ["knee"]


def test_in_print_everything_is_shown(browser, report: Path) -> None:
    browser.open(report, 800, medium="print")
    assert not browser.evaluate("[...document.querySelectorAll('.live')].some(e => e.checkVisibility())")
    assert browser.print().startswith(b"%PDF")
