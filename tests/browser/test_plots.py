"""Plots of reports in a real browser: they zoom, tell values, hide curves and follow one another. The answers are made by hand."""

from pathlib import Path

import numpy as np
import pytest
from reported import by_effort, findings, identified, result

from rhythmid.record.record import Channel, Record
from rhythmid.report.diagnosis import diagnosis_page
from rhythmid.report.identification import identification_page
from rhythmid.report.page import write_page
from rhythmid.report.recording import recording_page

EVIL = '</script><img src=x onerror="alert(1)">'
PLOTS = "[...document.querySelectorAll('details[open] figure.wide .holder')].map(h => h.plot)"
RANGES = f"{PLOTS}.map(p => [p.scales.x.min, p.scales.x.max])"


@pytest.fixture(scope="module")
def others(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Pages of a diagnosis, an identification, a recording, hostile names, and a diagnosis by effort."""
    folder = tmp_path_factory.mktemp("others")
    told = findings(result())
    covariance = {
        "names": ["a.b", "c.d", "e.f"],
        "correlation": [[1, 0.95, None], [0.95, 1, -0.2], [None, -0.2, 1]],
    }
    time = np.delete(np.arange(6000) * 1e-3, 3000)  # with a gap
    made = {
        "diagnosis": diagnosis_page(told),
        "identification": identification_page(
            identified() | {"covariance": covariance}, "model from run", told.records, "rhythmid identify run", {}, runs=told.runs
        ),
        "recording": recording_page(
            {"path": EVIL, "size": 5e6, "duration": 6.0, "truncated": False, "usable": True, "topics": [], "channels": {}, "problems": []},
            Record(EVIL, Channel(time, np.sin(10.0 * time), "rad")), (EVIL,), "rhythmid check bag",
        ),
        "hostile": diagnosis_page(findings(result(), name=EVIL)),
        "effort": diagnosis_page(by_effort()),
    }  # fmt: skip
    for name, page in made.items():
        write_page(folder / f"{name}.html", page)
    return [folder / f"{name}.html" for name in made]


@pytest.fixture(scope="module")
def page(others: list[Path]) -> Path:
    """The page of a diagnosis."""
    return others[0]


def ranges(browser) -> list[list[float]]:
    browser.settle()
    return browser.evaluate(RANGES)


def frame(browser) -> tuple[float, float, float, float]:
    """Left, top, width and height of the first plot over time that is open, where it is on the screen."""
    browser.evaluate(f"{PLOTS}[0].over.scrollIntoView({{block: 'center', behavior: 'instant'}})")
    browser.settle()
    return tuple(
        browser.evaluate(
            f"(() => {{ const r = {PLOTS}[0].over.getBoundingClientRect(); return [r.left, r.top, r.width, r.height] }})()"
        )
    )


def test_dragging_zooms_and_what_has_the_same_time_axis_follows(browser, page: Path) -> None:
    browser.open(page, 1200)
    left, top, width, height = frame(browser)
    motion, residual = ranges(browser)
    assert motion == residual
    y, begin, end = top + height / 2, left + 0.25 * width, left + 0.5 * width
    browser.mouse(("moved", begin, y), ("pressed", begin, y), ("moved", end, y), ("released", end, y))
    size = motion[1] - motion[0]
    wanted = [motion[0] + 0.25 * size, motion[0] + 0.5 * size]
    for zoomed in ranges(browser):
        assert zoomed == pytest.approx(wanted, abs=0.01 * size)
    browser.mouse(("pressed", end, y), ("released", end, y))
    browser.mouse(("pressed", end, y), ("released", end, y), clicks=2)
    assert ranges(browser) == [motion, residual]
    assert browser.messages == []


def test_the_pointer_shows_the_values_of_all_curves(browser, page: Path) -> None:
    browser.open(page, 1200)
    left, top, width, height = frame(browser)
    browser.mouse(("moved", left + 0.4 * width, top + 0.5 * height))
    browser.settle()
    rows = browser.evaluate(f"[...{PLOTS}[0].tip.children].map(row => row.innerText)")
    at, value = browser.evaluate(
        f"(() => {{ const p = {PLOTS}[0], i = p.cursor.idx; return [p.data[0][i], p.data[1][i]] }})()"
    )
    assert [row.split(":")[0] for row in rows[1:]] == [
        "measured", "refitted nominal model", "with the added effect",
    ]  # fmt: skip
    assert float(rows[0].split()[1]) == pytest.approx(at, rel=1e-3)
    assert float(rows[1].split()[1]) == pytest.approx(value, rel=1e-3) and rows[1].endswith("mm")
    browser.mouse(("moved", 5, 5))
    assert browser.evaluate(f"{PLOTS}[0].tip.hidden")


def test_a_legend_hides_and_shows_a_curve(browser, page: Path) -> None:
    browser.open(page, 1200)
    button = "document.querySelectorAll('details[open] figure.wide')[1].querySelector('.legend button')"
    height = f"(() => {{ const s = {PLOTS}[1].scales.y; return s.max - s.min }})()"
    whole = browser.evaluate(height)
    browser.evaluate(f"{button}.click()")
    browser.settle()
    assert browser.evaluate(f"[{PLOTS}[1].series[1].show, {button}.ariaPressed]") == [False, "false"]
    assert browser.evaluate(height) < 0.5 * whole  # the curve that is left has the room
    browser.evaluate(f"{button}.click()")
    browser.settle()
    assert browser.evaluate(f"[{PLOTS}[1].series[1].show, {button}.ariaPressed]") == [True, "true"]
    assert browser.evaluate(height) == pytest.approx(whole)


def test_keys_and_buttons_do_what_the_mouse_does(browser, page: Path) -> None:
    browser.open(page, 1200)
    whole = ranges(browser)[0]
    browser.evaluate("document.querySelector('details[open] figure.wide .holder').focus()")
    browser.key("+")
    assert ranges(browser)[1] == pytest.approx(
        [whole[0] + 0.15 * (whole[1] - whole[0]), whole[1] - 0.15 * (whole[1] - whole[0])]
    )
    browser.key("ArrowRight")
    assert "measured: " in browser.evaluate(
        "document.querySelector('details[open] figure.wide .unseen').textContent"
    )
    browser.key("0")
    assert ranges(browser)[0] == whole
    names = browser.evaluate("[...document.querySelector('.tools').children].map(b => b.ariaLabel)")
    assert names == ["Move left", "Move right", "Zoom out", "Zoom in", "Show all"]
    for index, inside in ((3, True), (1, True), (4, False)):
        browser.evaluate(f"document.querySelectorAll('details[open] .tools')[0].children[{index}].click()")
        now = ranges(browser)[0]
        assert (now[1] - now[0] < whole[1] - whole[0]) is inside


def test_an_orbit_is_drawn_in_the_order_of_its_points_and_can_be_read(browser, page: Path) -> None:
    browser.open(page, 1200)
    orbit = "[...document.querySelectorAll('details[open] .holder')].map(h => h.plot).find(p => p.mode === 2)"
    browser.evaluate(f"{orbit}.over.scrollIntoView({{block: 'center', behavior: 'instant'}})")
    x, y, at, speed = browser.evaluate(
        f"""(() => {{ const p = {orbit}, r = p.over.getBoundingClientRect(), [xs, ys] = p.data[1], i = xs.length >> 1;
            return [r.left + p.valToPos(xs[i], 'x'), r.top + p.valToPos(ys[i], 'y'), xs[i], ys[i]] }})()"""
    )
    browser.mouse(("moved", x, y))
    browser.settle()
    rows = browser.evaluate(f"[...{orbit}.tip.children].map(row => row.innerText)")
    told = [float(row.split()[1].replace("−", "-")) for row in rows[1:]]
    assert told == pytest.approx([at, speed], abs=0.05 * max(abs(at), abs(speed)))


def test_every_plot_of_every_report_has_data_and_is_drawn(browser, others: list[Path]) -> None:
    for path in others:
        browser.open(path, 390)
        browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
        browser.settle()
        plots = browser.evaluate(
            """[...document.querySelectorAll('figure > script')].map(script => {
                const plot = script.parentElement.querySelector('.holder').plot, canvas = plot.ctx.canvas;
                const pixels = plot.ctx.getImageData(0, 0, canvas.width, canvas.height).data;
                let inked = 0;
                for (let i = 3; i < pixels.length; i += 4) inked += pixels[i] > 0;
                const last = plot.data.at(-1), values = plot.mode === 2 ? last[1] : last;
                return { points: values.filter(v => v !== null).length, inked, curves: plot.series.length - 1 } })"""
        )
        assert len(plots) >= 2, path
        for plot in plots:
            assert plot["points"] > 1 and plot["inked"] > 500 and plot["curves"] > 0, (path, plot)
        assert browser.evaluate("document.documentElement.scrollWidth") <= 390, path
        assert browser.messages == [] and browser.requests == [path.as_uri()]


def test_without_scripts_the_drawings_are_shown(browser, page: Path) -> None:
    browser.open(page, 1200, scripts=False)
    assert browser.evaluate(
        "[...document.querySelectorAll('section > figure > svg')].every(s => s.checkVisibility())"
    )
    assert browser.evaluate("document.querySelectorAll('.live').length") == 0
    assert not browser.evaluate("document.querySelector('.hint').checkVisibility()")
