"""Differences by which sensitivities are taken: steps that move the outputs a little, and do not grow where nothing moves them."""

import warnings

import numpy as np
import pytest

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.descent import WHITE, first_guess
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.multiple_shooting import windows
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import minimise
from rhythmid.identify.sensitivity import COARSER, Problem
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CREEPING = """
inertia: {{mass: {{value: 1.0, unit: kg}}}}
force:
  - linear_spring: {{stiffness: {{value: 100.0, unit: N/m}}}}
  - viscous_damper: {{damping: {{value: 0.4, unit: N*s/m}}}}
  - viscoelastic_relaxation: {{stiffness: {{value: {creep}, unit: N/m}}, time_constant: {{value: 0.1, unit: s}}}}
"""
FAINT = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 100.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 0.4, unit: N*s/m}}
  - second_mode:
      mass: {value: 1.0e-4, unit: kg, fixed: true}
      frequency: {value: 3.0, unit: Hz, fixed: true}
      damping_ratio: {value: 0.05, unit: "1", fixed: true}
"""


def settled(creep: float, times: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steps of the parameters and states, and the sensitivities, after so many linearisations of a free decay."""
    model = Model.from_text(CREEPING.format(creep=creep))
    time = np.arange(0.0, 4.0, 0.01)
    series = prepare([Record("decay", Channel(time, np.exp(-0.2 * time) * np.cos(10.0 * time), "m"))])
    run = prepare_run(model, series)
    problem, starts = Problem(run, model.free, WHITE, None), first_guess(model, run)
    problem.learn_hidden(model, starts)
    residuals = problem.residuals(model, starts)
    assert residuals is not None
    steps, states = np.full(len(model.free), 1e-4), np.full(run.states, 1e-4)
    jacobian = np.empty(0)
    for _ in range(times):
        found, _, steps, states = problem.linearise(model, starts, residuals, steps, states)
        jacobian = found.jacobian
    return steps, states, jacobian


def test_steps_of_what_nothing_shows_do_not_grow_for_ever():
    """A creep without stiffness: neither its time constant nor its state does anything."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        steps, states, jacobian = settled(0.0, 80)
    assert steps.max() < 1.0 and states.max() < 1.0 and np.isfinite(jacobian).all()


@pytest.mark.parametrize("creep", [1.0, 20.0])
def test_steps_settle_where_each_moves_the_outputs_by_a_ten_thousandth(creep):
    steps, states, _ = settled(creep, 12)
    again = settled(creep, 13)
    np.testing.assert_allclose(again[0], steps, rtol=0.2)
    np.testing.assert_allclose(again[1], states, rtol=0.2)


def test_a_fit_that_is_repeated_from_its_end_stays_there_whatever_states_the_elements_have():
    """A free decay by dry friction, and in its place a mode of hardly any mass: from fit to fit its start must not wander off."""
    model = Model.from_text(FAINT)
    time = np.arange(0.0, 10.0, 0.01)
    decay = np.maximum(1.0 - 0.08 * time, 0.0) * np.cos(10.0 * time)
    run = prepare_run(model, prepare([Record("decay", Channel(time, decay, "m"))]))
    noise = NoiseModel(np.empty(0), 3e-3)
    fits = [minimise(model, run, model.free, noise)]
    for _ in range(4):
        fits.append(minimise(fits[-1].model, run, model.free, noise, fits[-1].starts))
    np.testing.assert_allclose(fits[-1].starts[0], fits[1].starts[0], rtol=0.05)
    assert fits[-1].chi2 == pytest.approx(fits[1].chi2, rel=1e-3)


def test_all_windows_of_a_record_have_the_widest_usual_range_of_its_states():
    model = Model.from_text(FAINT)
    time = np.arange(0.0, 10.0, 0.01)
    decay = np.exp(-0.5 * time) * np.cos(10.0 * time)
    run = prepare_run(model, windows(prepare([Record("decay", Channel(time, decay, "m"))]), 2.0))
    problem = Problem(run, (), WHITE, None)
    problem.learn_hidden(model, first_guess(model, run))
    scatters = np.array([scatter for _, scatter in problem.hidden])
    assert len(scatters) > 3 and np.ptp(scatters, axis=0) == pytest.approx(0.0)
    assert scatters[0][0] > 0.5


def test_sensitivities_in_coarser_steps_are_those_of_the_run(monkeypatch):
    time = np.arange(0.0, 4.0, 0.01)
    series = prepare([Record("decay", Channel(time, np.exp(-0.2 * time) * np.cos(10.0 * time), "m"))])
    model = Model.from_text(CREEPING.format(creep=10.0)).with_element(
        load_catalogue()["coulomb_friction"], {"force": 0.3, "transition": 0.0}
    )
    found = []
    for coarser in (1.0, COARSER):
        monkeypatch.setattr("rhythmid.identify.sensitivity.COARSER", coarser)
        run = prepare_run(model, series, 2.5e-4)
        problem, starts = Problem(run, model.free, WHITE, None), first_guess(model, run)
        problem.learn_hidden(model, starts)
        residuals = problem.residuals(model, starts)
        assert residuals is not None
        steps, states = np.full(len(model.free), 1e-4), np.full(run.states, 1e-4)
        found.append(problem.linearise(model, starts, residuals, steps, states)[0].jacobian)
    fine, coarse = found
    assert not np.array_equal(fine, coarse)
    felt = [
        model.free.index(name) for name in model.free if name != "coulomb_friction.transition"
    ]  # far below a step
    error = np.linalg.norm(coarse - fine, axis=0)[felt] / np.linalg.norm(fine, axis=0)[felt]
    assert error.max() < 0.1  # of dry friction, whose error falls with the step and not with its fourth power
