"""A round of the search scores the catalogue at the fit that it returns."""

import math

import pytest

import rhythmid as rh
from rhythmid.diagnose.search.round import one_round
from rhythmid.diagnose.search.score_tests import (
    best_changes,
    changes_of,
    score,
    sizes_along,
    trajectories,
)
from rhythmid.elements.candidates import candidates
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare

PENDULUM = """
inertia: {mass: {value: 0.0057, unit: kg*m^2, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 0.42, unit: N*m/rad}, rest_length: {value: 0.0, unit: rad, fixed: true}}
  - viscous_damper: {damping: {value: 0.0013, unit: N*m*s/rad}}
"""
SPRING = """
inertia: {mass: {value: 1.0, unit: kg}}
force:
  - linear_spring: {stiffness: {value: 60.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 0.6, unit: N*s/m}}
"""
SHAKEN = {
    "duration": 30.0,
    "excitation": {"type": "chirp", "amplitude": 0.5, "sweep": 10.0, "band": [0.3, 4.0]},
    "noise": {"measurement_std": 1e-4},
}
SWUNG = {
    "duration": 20.0,
    "forcing": {"amplitude": 1.0, "frequency": 1.0},
    "excitation": {"type": "chirp", "amplitude": 0.05, "sweep": 20.0, "band": [0.5, 2.0]},
    "noise": {"measurement_std": 1e-3},
}


def test_scores_are_those_of_changes_at_the_fit_that_the_noise_of_the_round_has_moved():
    library = load_catalogue()
    model = rh.Model.from_text(PENDULUM)
    swinging = model.with_values({"linear_spring.stiffness": 0.0}).with_element(
        library["pendulum_gravity"], {"moment": 0.42, "reference": 0.0}
    )
    fit = estimate(model, prepare([rh.simulate(swinging, SWUNG).record]))
    catalogue = Catalogue({name: library[name] for name in ("pendulum_gravity", "cubic_stiffness")})
    found, moved = one_round(fit, (), catalogue, None)
    known = trajectories(moved)
    again = score(
        moved, changes_of(known, candidates(catalogue, moved.model.setting, sizes_along(known)).tried)
    )
    # most of a pendulum's gravity is what a spring does: only at the same fit is that told from the rest
    assert moved.values != pytest.approx(fit.values, rel=1e-3)
    assert [one.statistic for one in found.scores] == pytest.approx(
        [one.statistic for one in again], rel=1e-6
    )
    best = best_changes(
        moved, changes_of(known, candidates(catalogue, moved.model.setting, sizes_along(known)).tried), 2
    )
    assert [(one.element, one.values) for one in best] == [(one.element, one.values) for one in again[:2]]


def test_a_resonance_that_no_candidate_knows_is_not_the_noise_s_colour():
    library = load_catalogue()
    model = rh.Model.from_text(SPRING)
    swinging = model.with_element(
        library["second_mode"], {"mass": 0.2, "frequency": 1.0, "damping_ratio": 0.1}
    )
    made = rh.simulate(swinging, SHAKEN).record
    fit = estimate(model, prepare([made]))
    _, moved = one_round(fit, (), Catalogue({"cubic_stiffness": library["cubic_stiffness"]}), None)
    assert fit.nrmse() > 0.05
    # most of what is left follows from the past motion, and is no noise
    assert moved.noise.variance < 0.3 * fit.noise.variance
    assert moved.chi2 > 3.0 * moved.samples


def test_a_vibration_at_the_frequency_of_a_free_motion_is_no_candidate():
    """It would explain most of what friction does to a decay, and is never told from it."""
    library = load_catalogue()
    model = rh.Model.from_text(SPRING)
    rubbing = model.with_element(library["coulomb_friction"], {"force": 0.3})
    released = {"duration": 12.0, "excitation": {"type": "silence", "length": 12.0}, "forcing": {"amplitude": 0.0},
                "initial": {"position": 0.1, "velocity": 0.0}, "noise": {"measurement_std": 1e-5}}  # fmt: skip
    fit = estimate(model, prepare([rh.simulate(rubbing, released).record]))
    catalogue = Catalogue({name: library[name] for name in ("periodic_disturbance", "coulomb_friction")})
    found, _ = one_round(fit, (), catalogue, None)
    own = math.sqrt(60.0) / (2.0 * math.pi)  # Hz
    lines = [one.values["frequency"] for one in found.scores if one.element.name == "periodic_disturbance"]
    assert lines
    assert min(abs(one - own) for one in lines) > 1.0 / 12.0
    assert found.scores[0].element.name == "coulomb_friction"
