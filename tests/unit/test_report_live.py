"""Data of a page's plots: what the script draws is what the chart says, within the page's budget."""

import base64
import json

import numpy as np
import pytest

from rhythmid.report.chart import Chart, Curve
from rhythmid.report.live import FEWEST_POINTS, MISSING, VALUE, chart_data, most_points

TIME = np.arange(50_000) * 1e-3


def chart(*curves: Curve, **options) -> Chart:
    return Chart("what it shows", "time [s]", "position [m]", curves, **options)


def told(given: Chart, most: int = 100_000) -> dict:
    return json.loads(chart_data(given, most))


def values(stored: dict) -> np.ndarray:
    steps = np.frombuffer(base64.b64decode(stored["uint16"]), "<u2")
    found = np.where(steps == MISSING, np.nan, stored["low"] + stored["step"] * steps.astype(float))
    return 10.0**found if stored["log"] else found


def grid(stored: dict) -> np.ndarray:
    if "count" in stored:
        return stored["first"] + stored["step"] * np.arange(stored["count"])
    return stored["first"] + np.frombuffer(base64.b64decode(stored["float32"]), "<f4")


def test_values_are_kept_to_a_part_in_a_hundred_thousand_of_their_range() -> None:
    y = 3.0 + 0.01 * np.sin(TIME)
    y[7] = np.nan
    found = told(chart(Curve(TIME, y, "a", "before")))
    assert grid(found["xs"]) == pytest.approx(TIME)
    assert values(found["curves"][0]["y"]) == pytest.approx(y, abs=1e-5 * 0.02, nan_ok=True)


def test_on_a_logarithmic_axis_small_values_are_kept_as_well_as_large_ones() -> None:
    y = np.logspace(-9, 2, 1000)
    found = told(chart(Curve(np.arange(1.0, 1001.0), y, "a", "before"), y_log=True))
    assert values(found["curves"][0]["y"]) == pytest.approx(y, rel=1e-3)


def test_uneven_times_and_a_gap_are_kept() -> None:
    x = np.concatenate([TIME[:100], TIME[300:400]])
    assert grid(told(chart(Curve(x, x, "a", "before")))["xs"]) == pytest.approx(x, abs=1e-6)


def test_a_spike_survives_thinning() -> None:
    y = np.zeros(50_000)
    y[31_234] = 1.0
    found = told(chart(Curve(TIME, y, "a", "before")), 1000)
    x, kept = grid(found["xs"]), values(found["curves"][0]["y"])
    assert len(x) == len(kept) == 1000
    assert kept.max() == pytest.approx(1.0) and x[kept.argmax()] == pytest.approx(31.234, abs=0.1)


def test_curves_over_different_x_share_a_common_one_without_reaching_beyond_their_ends() -> None:
    near, far = np.linspace(0.0, 1.0, 5), np.linspace(0.5, 2.0, 4)
    found = told(chart(Curve(near, near, "a", "before"), Curve(far, 2.0 * far, "b", "after")))
    x = grid(found["xs"])
    assert x == pytest.approx(np.unique(np.concatenate([near, far])))
    second = values(found["curves"][1]["y"])
    assert np.isnan(second[x < 0.5]).all() and second[x >= 0.5] == pytest.approx(2.0 * x[x >= 0.5], abs=1e-3)


def test_an_orbit_keeps_its_own_x() -> None:
    turn = np.linspace(0.0, 12.0, 500)
    found = told(chart(Curve(np.cos(turn), np.sin(turn), "a", "before"), path=True))
    assert values(found["curves"][0]["x"]) == pytest.approx(np.cos(turn), abs=1e-4)


def test_very_many_records_stay_within_the_budget_and_few_are_kept_whole() -> None:
    one = chart(Curve(TIME, TIME, "a", "before"))
    assert most_points([one]) == len(TIME)
    most = most_points([one] * 40)
    assert FEWEST_POINTS < most < len(TIME)
    assert 40 * most * VALUE == pytest.approx(700_000, rel=0.01)


def test_what_a_recording_is_called_stays_data() -> None:
    text = chart_data(chart(Curve(TIME[:3], TIME[:3], "</script><img src=x>&amp;", "before")), 100)
    assert "<" not in text and ">" not in text and "&" not in text
    assert json.loads(text)["curves"][0]["label"] == "</script><img src=x>&amp;"
