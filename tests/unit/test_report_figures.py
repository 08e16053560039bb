"""Figures of motion, correlation, evidence and recordings: what they show is what the answer says."""

import re
from dataclasses import replace

import numpy as np
import pytest
from reported import findings, hypothesis, identified, result

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.identify import paper_hopper
from rhythmid.identify.switching import switches_of
from rhythmid.record.record import Channel, Record
from rhythmid.report.correlation import Correlation, correlation_figure
from rhythmid.report.evidence_chart import Evidence, draw_evidence
from rhythmid.report.hypotheses import hypotheses_section
from rhythmid.report.identification import identification_page
from rhythmid.report.motion_figures import over_time, portrait, time_link
from rhythmid.report.page import render
from rhythmid.report.recording import recording_page
from rhythmid.report.residual_figures import residual_figures
from rhythmid.report.run import Compared, Switch

MOTION = Compared("motion", "m")
RUN = findings(result()).runs[0]


def test_measured_and_simulated_share_their_time_axis_with_the_residual() -> None:
    motion, residual, *_ = residual_figures(RUN, MOTION, "m")
    assert motion.chart.link == residual.chart.link == time_link(RUN)
    assert [curve.label for curve in motion.chart.curves] == ["measured", *RUN.labels]
    assert motion.chart.curves[0].y == pytest.approx(1e3 * RUN.measured)
    assert motion.chart.y_label == "motion [mm]"


def test_records_of_one_name_that_were_fitted_and_held_out_are_not_linked() -> None:
    assert time_link(RUN) != time_link(replace(RUN, heldout=True))


def test_what_was_hidden_from_the_fit_is_shaded() -> None:
    hidden = RUN.time > 6.0
    (stretch,) = over_time(replace(RUN, hidden=hidden, used=~hidden), MOTION).chart.shaded
    assert stretch == pytest.approx((6.01, RUN.time[-1]))


def test_the_phase_portrait_of_a_sine_is_an_ellipse_with_its_switch() -> None:
    switched = replace(
        RUN, switches=(Switch("v", 0.0, "Damper"), Switch("x", 0.002, "Stop"), Switch("x", 9.0, "Far"))
    )
    chart = portrait(switched, MOTION).chart
    x, v = chart.curves[0].x, chart.curves[0].y
    inner = slice(20, -20)
    assert (x / 10.0)[inner] ** 2 + (v / (20.0 * np.pi))[inner] ** 2 == pytest.approx(1.0, abs=0.02)
    assert chart.uprights == pytest.approx((2.0,))  # one beyond the travel is not drawn
    assert chart.levels == (0.0,)
    assert "Damper" in portrait(switched, MOTION).caption


@pytest.mark.parametrize(
    ("run", "compared"),
    [
        (RUN, Compared("effort", "N")),
        (replace(RUN, switches=None), MOTION),
        (replace(RUN, used=RUN.hidden), MOTION),
    ],
)
def test_without_a_position_there_is_no_phase_portrait(run, compared) -> None:
    assert portrait(run, compared) is None


def test_a_model_tells_where_its_elements_switch() -> None:
    catalogue = load_catalogue()
    model = paper_hopper().with_element(catalogue["bilinear_stiffness"], {"change": 5.0, "kink": 0.17})
    model = model.with_element(catalogue["ground_contact_loss"], {"loss": 0.2})
    found = {one.name: (one.signal, one.value) for one in switches_of(model)}
    assert found == {
        "Direction-switched damper": ("v", 0.0), "Bilinear stiffness": ("x", 0.17), "Loss of ground contact": ("x", 0.2),
    }  # fmt: skip


@pytest.mark.parametrize(
    "element", [e for e in load_catalogue().values() if e.switches], ids=lambda e: e.name
)
def test_an_element_switches_at_a_parameter_that_its_kernel_is_given(element) -> None:
    signal, parameter = element.switches
    assert signal in element.leading
    assert parameter == "" or parameter in element.arguments


def test_correlations_are_written_out_and_the_strong_ones_named() -> None:
    matrix = np.array([[1.0, 0.97, np.nan], [0.97, 1.0, -0.004], [np.nan, -0.004, 1.0]])
    figure = correlation_figure(Correlation(("spring.stiffness", "spring.rest", "damper.damping"), matrix))
    assert "spring: stiffness with spring: rest (0.97)" in figure.caption
    assert "spring: rest with damper: damping 0.00" in figure.svg and "—" in figure.svg
    assert figure.svg.count('class="cell panel edge"') == 3


def test_no_two_that_are_hard_to_tell_apart_are_named_where_there_are_none() -> None:
    assert (
        "No two are correlated by more than 0.9"
        in correlation_figure(Correlation(("a", "b"), np.eye(2))).caption
    )


def places(svg: str) -> list[float]:
    return [float(x) for x in re.findall(r'<circle[^>]* cx="([\d.]+)"', svg)]


def test_worse_hypotheses_stand_further_to_the_right_and_near_ones_are_told_apart() -> None:
    rows = [
        Evidence(name, worse, 1.0, "1 %")
        for name, worse in (("a", 0.0), ("b", 5.0), ("c", 100.0), ("d", 1e5))
    ]
    found = places(draw_evidence("what it shows", rows, np.log(40.0), "40 to 1", "probability"))
    assert found == sorted(found) and found[1] - found[0] > 20.0 and found[-1] < 320.0


def test_the_evidence_says_which_hypotheses_are_chosen_equivalent_and_rejected() -> None:
    told = result()
    (chart,) = [
        b for b in hypotheses_section(findings(told)).blocks if getattr(b, "title", "").endswith("hypotheses")
    ]
    assert "Coulomb friction: predicts worse by 0" in chart.svg
    assert "rejected: so small a part belongs to something else" in chart.svg
    assert [label for _, label in chart.legend] == [
        "chosen",
        "as good as the chosen one",
        "rejected, see below",
        "less likely",
    ]
    alone = findings(
        result("consistent") | {"hypotheses": [hypothesis("nominal", 0.0, 1.0, [])], "rejections": []}
    )
    assert any(getattr(b, "title", "") == "The only hypothesis" for b in hypotheses_section(alone).blocks)


def test_an_identification_shows_what_it_leaves_of_the_records() -> None:
    html = render(
        identification_page(
            identified(), "m", (), "rhythmid identify run", {}, runs=(replace(RUN, after=None),)
        )
    )
    assert "Residual over time" in html and "Phase portrait" in html and "Measured and simulated" in html


def recording(problems=(), remarks=()) -> str:
    time = np.delete(np.arange(1000) * 1e-3, 500)
    record = Record("bag", Channel(time, np.cos(time), "rad", "/joint_states"))
    told = {
        "path": "bag", "size": 1_234_567, "duration": 1.0, "truncated": False, "usable": not problems, "problems": list(problems),
        "channels": {role: one.to_dict() for role, one in record.quality.channels.items()}, "topics": [],
    }  # fmt: skip
    return render(recording_page(told, None if problems else record, remarks, "rhythmid check bag"))


def test_a_recording_is_usable_with_remarks_or_not_usable() -> None:
    assert "<h1>Usable, and nothing to remark</h1>" in recording()
    assert "<h1>Usable, with remarks</h1>" in recording(
        remarks=["output: 1 gap"]
    ) and "Output: 1 gap." in recording(remarks=["output: 1 gap"])
    refused = recording(problems=["bag: there is no output"])
    assert (
        "<h1>Not usable</h1>" in refused
        and "Bag: there is no output." in refused
        and "<figure" not in refused
    )


def test_a_gap_stands_out_of_the_time_between_samples() -> None:
    assert "Longest: 2\u202fms" in recording()
