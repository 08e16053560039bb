"""The screening of candidates: first guesses with what goes with them, and the line that a residual holds."""

import warnings
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import rhythmid as rh
from rhythmid.diagnose.search.score_tests import (
    Trajectories,
    changes_of,
    residual_line,
    score,
    trajectories,
)
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.series import Series, prepare

PERIOD, BLOCK = 1e-3, 5


def fit_of(frequency: float, amplitude: float, *blocks: int) -> Fit:
    """A fit that leaves white noise of size one and a line in series of so many blocks."""
    rng = np.random.default_rng(5)
    made, residuals = [], []
    for count in blocks:
        time = PERIOD * np.arange(count * BLOCK)
        made.append(Series("made", time, time, None, None, BLOCK, np.ones(count, bool), PERIOD))
        phase = 2 * np.pi * (frequency * made[-1].centres + rng.uniform())
        residuals.append(amplitude * np.sin(phase) + rng.standard_normal(count))
    return cast(Fit, SimpleNamespace(run=SimpleNamespace(series=tuple(made)), residuals=tuple(residuals)))


@pytest.mark.parametrize("frequency", [3.7, 3.74, 3.7771, 11.113])
def test_a_line_between_bins_is_found_in_series_of_different_lengths(frequency):
    lengths = 700, 1000, 1613
    bin_width = 1.0 / (max(lengths) * BLOCK * PERIOD)
    assert residual_line(fit_of(frequency, 5.0, *lengths)) == pytest.approx(frequency, abs=0.03 * bin_width)


def test_a_line_too_faint_for_one_series_is_found_in_many():
    assert residual_line(fit_of(7.31, 0.3, *[800] * 12)) == pytest.approx(7.31, abs=0.02)


def test_too_short_or_silent_residuals_hold_no_line():
    assert residual_line(fit_of(7.31, 5.0, 8)) == 0.0
    quiet = fit_of(7.31, 5.0, 500)
    still = SimpleNamespace(run=quiet.run, residuals=(np.full(500, 0.1),))
    assert residual_line(cast(Fit, still)) == 0.0


def test_a_guess_brings_what_the_models_own_parameters_had_stood_in_for():
    text = (
        "inertia: {mass: {value: 1.0, unit: kg, fixed: true}}\nforce:\n"
        "  - linear_spring: {stiffness: {value: 300, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}\n"
        "  - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}\n"
    )
    element = load_catalogue()["second_mode"]
    values = {"mass": 0.2, "frequency": 9.0, "damping_ratio": 0.1}
    model = rh.Model.from_text(text)
    run = {
        "excitation": {"type": "chirp", "amplitude": 1.0, "sweep": 10.0, "band": [0.5, 8.0]},
        "noise": {"measurement_std": 1e-6},
    }
    record = rh.simulate(model.with_element(element, values), run).record
    fit = estimate(model, prepare([record]))
    fitted = fit.model.value("linear_spring.stiffness")
    (best,) = score(fit, changes_of(trajectories(fit), [(element, values | {"mass": 0.03})]))
    begun = best.own(fit.model)["linear_spring.stiffness"]
    assert fitted < 270.0 and abs(begun - 300.0) < 0.5 * abs(fitted - 300.0)
    assert best.start["mass"] == pytest.approx(0.2, rel=0.5)
    low = best.own(fit.model, 0.0)
    assert low["linear_spring.stiffness"] == fitted  # nothing of the effect moves nothing


def test_what_repeats_less_than_five_times_in_a_record_is_no_periodic_disturbance(scales):
    narrowed = load_catalogue().within(scales)["periodic_disturbance"].parameter("frequency")
    assert narrowed.bounds == (5.0 / scales.duration, 0.5 / scales.period)


def test_what_swings_less_than_once_in_a_record_is_no_second_mode(scales):
    short = replace(scales, duration=0.5 / scales.natural_frequency)
    narrowed = load_catalogue().within(short)["second_mode"].parameter("frequency")
    assert narrowed.bounds == (1.0 / short.duration, 0.5 / short.period)
    assert (
        load_catalogue().within(scales)["second_mode"].parameter("frequency").bounds[0] < narrowed.bounds[0]
    )


def test_the_middle_of_a_sensors_curvature_lies_within_the_motion(scales):
    narrowed = load_catalogue().within(scales)["sensor_nonlinearity"].parameter("reference")
    assert narrowed.bounds == (scales.low, scales.high)


def test_a_force_that_cannot_be_squared_is_no_candidate():
    model = rh.Model.from_text(
        "inertia: {mass: {value: 1.0, unit: kg, fixed: true}}\nforce:\n"
        "  - linear_spring: {stiffness: {value: 300, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}\n"
    )
    run = {"excitation": {"type": "chirp", "amplitude": 1.0, "sweep": 5.0, "band": [0.5, 4.0]}}
    fit = estimate(model, prepare([rh.simulate(model, run).record]))
    cubic = load_catalogue()["cubic_stiffness"]
    found = changes_of(trajectories(fit), [(cubic, {"coefficient": size}) for size in (1e250, 1.0)])
    assert [one.values["coefficient"] for one in found] == [1.0]


def test_a_change_too_large_to_square_is_left_out_without_a_warning(monkeypatch):
    element, sizes = load_catalogue()["linear_spring"], iter([1e200, 1e3])
    monkeypatch.setattr(
        "rhythmid.diagnose.search.score_tests.change_of_output",
        lambda *_: [next(sizes) * np.ones(20)],
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kept = list(changes_of(cast(Trajectories, None), [(element, {}), (element, {})]))
    assert [float(one.outputs[0][0]) for one in kept] == [1e3]
