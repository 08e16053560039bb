"""Drawings of the report: what is drawn stands where it should."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from rhythmid.report.chart import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Chart, Curve, draw, linear_ticks
from rhythmid.report.evidence_chart import Evidence, draw_evidence
from rhythmid.report.row_chart import Bar, Change, draw_bars, draw_changes
from rhythmid.report.run_chart import Point, draw_runs
from rhythmid.report.signal_path import SlotContent, draw_signal_path
from rhythmid.report.state_map import draw_maps, state_map

SVG = "{http://www.w3.org/2000/svg}"


def paths(svg: str, kind: str) -> list[np.ndarray]:
    """Points (n, 2) of every path whose class begins with `kind`."""
    found = ElementTree.fromstring(svg).iter(f"{SVG}path")
    return [
        np.array(
            [[float(n) for n in pair.split()] for pair in re.split("[ML]", path.attrib["d"].rstrip("Z"))[1:]]
        )
        for path in found
        if path.attrib["class"].startswith(kind)
    ]


def chart(x: np.ndarray, y: np.ndarray, **options) -> str:
    return draw(Chart("a test", "x", "y", (Curve(x, y, "curve", "before"),), **options))


def test_a_line_spans_the_frame_and_keeps_its_proportions() -> None:
    x = np.array([0.0, 1.0, 4.0])
    (points,) = paths(chart(x, 2.0 * x), "line")
    across = LEFT + x / 4.0 * (WIDTH - RIGHT - LEFT)
    assert points[:, 0] == pytest.approx(across, abs=0.06)
    heights = points[:, 1]
    assert np.all((heights >= TOP) & (heights <= HEIGHT - BOTTOM))
    assert (heights[0] - heights[1]) / (heights[0] - heights[2]) == pytest.approx(0.25, abs=0.01)


def test_a_gap_in_a_curve_is_not_bridged() -> None:
    y = np.ones(10)
    y[4:6] = np.nan
    assert len(paths(chart(np.arange(10.0), y), "line")) == 2


def test_a_spike_survives_when_samples_outnumber_pixels() -> None:
    y = np.zeros(50_000)
    y[31_234] = 1.0
    (ring,) = paths(chart(np.arange(50_000.0), y), "cover")
    top = ring[:, 1].min()
    assert top < ring[:, 1].max() - 150.0
    assert ring[ring[:, 1] == top, 0].mean() == pytest.approx(
        LEFT + 31_234 / 50_000 * (WIDTH - RIGHT - LEFT), abs=2.0
    )


def test_a_logarithmic_axis_gives_every_decade_the_same_room() -> None:
    (points,) = paths(chart(np.arange(3.0), np.array([1.0, 10.0, 100.0]), y_log=True), "line")
    steps = np.diff(points[:, 1])
    assert steps[0] == pytest.approx(steps[1], abs=0.2)


def test_ticks_are_round() -> None:
    assert linear_ticks(-0.3, 1.1) == pytest.approx([0.0, 0.5, 1.0])
    assert linear_ticks(0.0, 100.0) == pytest.approx([0.0, 20.0, 40.0, 60.0, 80.0, 100.0])


def test_texts_cannot_break_out_of_a_drawing() -> None:
    evil = '"><script>alert(1)</script>'
    for svg in (
        draw(
            Chart(
                evil,
                evil,
                evil,
                (Curve(np.arange(3.0), np.arange(3.0), evil, "before"),),
            )
        ),
        draw_bars(evil, [Bar(evil, 1.0, evil)], 0.5, evil),
        draw_changes(evil, [Change(evil, 1.0, 0.5, 0.1)], evil),
    ):
        assert "<script" not in svg
        ElementTree.fromstring(svg)


def test_every_drawing_says_what_it_shows() -> None:
    root = ElementTree.fromstring(chart(np.arange(3.0), np.arange(3.0)))
    assert root.attrib["role"] == "img"
    assert root.attrib["aria-label"] == "a test"


def test_bars_are_in_proportion_and_the_marked_one_stands_out() -> None:
    svg = draw_bars("bars", [Bar("a", 4.0, "4", "after", True), Bar("b", 1.0, "1")])
    widths = [float(r.attrib["width"]) for r in ElementTree.fromstring(svg).iter(f"{SVG}rect")]
    assert widths[0] / widths[1] == pytest.approx(4.0, rel=0.02)
    assert "strong" in svg


def test_a_map_shows_where_in_the_states_a_signal_is() -> None:
    rng = np.random.default_rng(1)
    x, v = rng.uniform(-1, 1, 40_000), rng.uniform(-2, 2, 40_000)
    found = state_map(x, v, np.where((x > 0) & (v < 0), 5.0, 0.0))
    columns, rows = 0.5 * (found.x[1:] + found.x[:-1]), 0.5 * (found.v[1:] + found.v[:-1])
    inside = (columns[None, :] > 0.1) & (rows[:, None] < -0.2)
    outside = (columns[None, :] < -0.1) | (rows[:, None] > 0.2)
    assert found.mean[inside] == pytest.approx(5.0)
    assert found.mean[outside] == pytest.approx(0.0)
    svg = draw_maps("map", [("before", found), ("after", found)], (1.0, "m"), (1.0, "m/s"), (1.0, "m"))
    assert "plus4" in svg
    ElementTree.fromstring(svg)


def test_the_signal_path_marks_the_faulty_slot_and_no_other() -> None:
    slots = {
        "force": SlotContent(("Gravity",), ("Coulomb friction",)),
        "sensor": SlotContent(("Measurement delay",)),
    }
    svg = draw_signal_path(slots, True, "the path")
    assert svg.count('class="slot faulty"') == 2  # once lying, once standing
    assert svg.count("missing here") == 2
    assert "+ Coulomb friction" in svg
    assert "the forcing" in svg
    assert "the forcing" not in draw_signal_path(slots, False, "the path")


def test_a_fault_in_the_clocks_is_marked() -> None:
    svg = draw_signal_path({"timing": SlotContent((), ("Clock skew",))}, True, "the path")
    assert svg.count("clocks faulty") == 2
    assert 'class="slot faulty"' not in svg


@pytest.mark.parametrize("kind", ["bars", "changes", "evidence"])
def test_names_of_rows_do_not_touch_however_many_lines_they_need(kind: str) -> None:
    names = [
        "short",
        "a name that needs quite a few words more than others do",
        "two lines of a name, no more",
        "last",
    ]
    svg = {
        "bars": lambda: draw_bars("", [Bar(name, 1.0, "1") for name in names]),
        "changes": lambda: draw_changes("", [Change(name, 2.0, 1.0) for name in names], "x"),
        "evidence": lambda: draw_evidence(
            "", [Evidence(name, 1.0, 0.1, "1 %") for name in names], 3.7, "40 to 1", "p"
        ),
    }[kind]()
    lines = [
        [float(line.attrib["y"]) for line in text.iter(f"{SVG}tspan")]
        for text in ElementTree.fromstring(svg).iter(f"{SVG}text")
    ]
    lines = [one for one in lines if one]
    assert [len(one) for one in lines] == [1, 3, 2, 1]
    for upper, lower in zip(lines, lines[1:], strict=False):
        assert lower[0] - upper[-1] >= 13.0


def test_runs_are_counted_in_whole_numbers_and_times_are_not() -> None:
    def ticks(places: tuple[float, ...]) -> list[str]:
        points = [Point(place, 1.0 + place, 0.1, "A", "a run") for place in places]
        svg = draw_runs("what it shows", "run", "N", points, 2.0)
        return re.findall(rf'y="{HEIGHT - BOTTOM + 16:.1f}"[^>]*>([^<]+)<', svg)

    assert ticks((1.0, 2.0, 3.0)) == ["1", "2", "3"]
    assert "0.4" in ticks((0.1, 0.5, 1.2))
