"""The 95 % quantile: one number, right, and the half-width of every interval that is printed."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from batches import made_up
from matplotlib.collections import LineCollection
from scipy.stats import norm

import rhythmid
from rhythmid.batch import present
from rhythmid.batch.scatter import trend
from rhythmid.identify.identifiability import Offset, _intervals
from rhythmid.identify.identification import Estimate
from rhythmid.proof.card import coverage
from rhythmid.proof.rate import Rate
from rhythmid.proof.score import Estimated
from rhythmid.report import residual_figures
from rhythmid.report.blocks import charts_of
from rhythmid.report.quantity import estimate, plus_minus
from rhythmid.report.run import SEGMENTS, Compared, Run, by_phase, error_of, harmonics
from rhythmid.statistics import NORMAL_95

QUANTILE = float(norm.ppf(0.975))
EVERYTHING = np.ones(6000, dtype=bool)
TIME = 0.005 * np.arange(6000)


def run(residual: np.ndarray) -> Run:
    """Thirty seconds of a 1 Hz motion of 10 mm, which a model misses by `residual`."""
    motion = 0.01 * np.cos(2.0 * np.pi * TIME)
    velocity = np.gradient(motion, TIME)
    return Run(
        "made", TIME, motion, motion - residual, motion, motion, velocity, TIME % 1.0, EVERYTHING, ~EVERYTHING
    )


def test_the_quantile_is_that_of_the_normal_distribution():
    assert pytest.approx(QUANTILE, rel=1e-12) == NORMAL_95


def test_the_quantile_is_written_once_in_the_whole_package():
    package = Path(rhythmid.__file__).parent
    found = [path.name for path in package.rglob("*.py") if re.search(r"\b1\.9[56]", path.read_text())]
    assert found == ["statistics.py"]


def test_an_estimate_is_printed_with_the_half_width_of_its_95_percent_interval():
    assert estimate(10.0, 1e3, "") == plus_minus(10.0, QUANTILE * 1e3)


def test_the_interval_of_a_rate_is_wilsons_at_95_percent():
    low, high = Rate(90, 100).interval
    for end in (low, high):  # its ends are the rates from which 0.9 is just 1.96 standard deviations away
        assert abs(0.9 - end) == pytest.approx(QUANTILE * np.sqrt(end * (1.0 - end) / 100), rel=1e-9)


def test_the_interval_of_an_error_is_the_scatter_of_its_segments():
    loud = np.repeat(np.where(np.arange(SEGMENTS) % 2, 3e-4, 1e-4), len(TIME) // SEGMENTS)
    residual = np.resize(loud, len(TIME))
    found = error_of([run(residual)], "before")
    assert found is not None and found.half is not None
    means = np.array([part.mean() for part in np.array_split(residual**2, SEGMENTS)])
    of_mean = means.std(ddof=1) / np.sqrt(SEGMENTS) / means.mean()
    assert found.half == pytest.approx(QUANTILE * found.ratio * 0.5 * of_mean, rel=1e-6)


def test_the_mean_over_the_cycle_is_drawn_with_its_95_percent_interval():
    noisy = run(1e-4 * np.random.default_rng(0).standard_normal(len(TIME)))
    charts = charts_of(residual_figures.residual_figures(noisy, Compared("motion", "m"), "m"))
    found = by_phase(noisy, "before")
    assert found is not None
    curve, _ = next(chart for chart in charts if chart.x_label.startswith("phase")).curves
    unit = float(np.mean(curve.y / found[1]))  # in which it is drawn
    np.testing.assert_allclose(curve.high - curve.low, 2.0 * QUANTILE * unit * found[2], rtol=1e-9)


def test_harmonics_are_told_with_their_95_percent_intervals():
    missed = run(1e-3 * np.cos(2.0 * np.pi * TIME))
    told = residual_figures.cycle_harmonics(missed, "", 0.5)
    assert told is not None
    (first, *_) = harmonics(missed, 0.5)
    assert told.rows[0][1] == plus_minus(first.measured, QUANTILE * first.std)


def test_the_interval_of_a_delay_that_only_its_sum_bounds_ends_at_that_sums_95_percent_interval():
    found = _intervals(Estimate(0.04, 1e-4, "s"), Estimate(0.05, 1e-4, "s"), Estimate(0.09, 1e-2, "s"), None)
    assert found["input"] == found["measurement"] == (0.0, pytest.approx(0.09 + QUANTILE * 1e-2, rel=1e-9))


def test_a_bound_on_the_clocks_offset_widens_by_the_delays_own_95_percent_interval():
    given = Estimate(0.04, 1e-3, "s"), Estimate(0.05, 2e-3, "s"), Estimate(0.09, 1e-5, "s")
    found = _intervals(*given, Offset(-0.005, 0.01))
    assert found["input"] == pytest.approx((0.035 - QUANTILE * 1e-3, 0.05 + QUANTILE * 1e-3))
    assert found["measurement"] == pytest.approx((0.04 - QUANTILE * 2e-3, 0.055 + QUANTILE * 2e-3))


def test_an_interval_of_the_proof_holds_what_is_within_the_quantile_and_nothing_beyond():
    inside, outside = (Estimated("a", 0.0, share * QUANTILE, 1.0) for share in (0.999, 1.001))
    assert coverage([inside, outside]) == Rate(1, 2)


def test_the_runs_of_a_batch_are_drawn_with_their_95_percent_intervals(tmp_path):
    found = made_up(tmp_path, [5.0, 6.0, 7.0], stds=[0.5, 0.4, 0.3])
    axis = found.plot()
    (bars,) = axis.collections
    assert isinstance(bars, LineCollection)
    halves = [0.5 * np.ptp(np.asarray(segment)[:, 1]) for segment in bars.get_segments()]
    assert halves == pytest.approx([QUANTILE * std for std in (0.5, 0.4, 0.3)])


def test_the_page_of_a_batch_draws_and_scales_by_the_95_percent_interval(tmp_path, monkeypatch):
    drawn: list = []
    plain = present.draw_runs

    def draw_runs(alt, label, unit, points, mean):
        drawn.extend(points)
        return plain(alt, label, unit, points, mean)

    monkeypatch.setattr(present, "draw_runs", draw_runs)
    found = made_up(tmp_path, [5.0, 6.0, 7.0], stds=[0.5, 0.4, 0.3])
    present.present(found, lambda _: "")
    assert [point.half for point in drawn] == pytest.approx([QUANTILE * std for std in (0.5, 0.4, 0.3)])
    (one,) = found.agreements
    for std, unit in ((6e-4, "mN"), (5e-4, "µN")):  # intervals of ± 1.18 mN and of ± 980 µN
        assert present._agreement_row(replace(one, mean=1e-6, std=std))[2].endswith(unit)


def test_the_interval_of_a_slope_is_students_at_95_percent():
    times = np.arange(5.0)
    slope = trend(np.array([0.0, 1.1, 1.9, 3.2, 3.9]), np.ones(5), ["a"] * 5, times)
    assert slope is not None and slope.freedom == 3
    assert slope.half == pytest.approx(3.182446 * slope.std, rel=1e-6)  # of tables, three degrees of freedom
