"""Refits of candidates: where the first guesses of an element lead away, fainter ones are tried."""

import math

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose import refit
from rhythmid.diagnose.refit import Proposal, propose, run_trials
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Descent
from rhythmid.identify.series import Series

QUIET = NoiseModel(np.empty(0), 1.0)
TIME = 1e-3 * np.arange(64)
STILL = Series("made", TIME, np.sin(60.0 * TIME), None, None, 1, np.ones(64, bool), 1e-3)


@pytest.mark.parametrize(
    ("name", "guess", "faint"),
    [
        ("coulomb_friction", {"force": 0.5, "transition": 0.02}, [{"force": 0.05}, {"force": 0.005}]),
        ("actuator_gain", {"gain": 1.5}, [{"gain": 1.05}, {"gain": 1.005}]),  # absent at one
        ("actuator_saturation", {"limit": 2.0}, [{"limit": 20.0}, {"limit": 200.0}]),  # absent at infinity
    ],
)
def test_fainter_guesses_approach_the_element_s_absence_and_keep_the_rest(name, guess, faint):
    element = CATALOGUE[name]
    made = propose(hopper(), element, [guess], ("one",))
    assert made.added == ("one", name)
    expected = [{f"{name}.{key}": value for key, value in (guess | one).items()} for one in faint]
    for found, wanted in zip(made.faint, expected, strict=True):
        assert found == pytest.approx(wanted)


def test_an_element_without_a_size_has_no_fainter_guesses():
    sizeless = [e for e in CATALOGUE.values() if not e.size]
    for element in sizeless:
        values = {p.name: 1.0 if p.default is None else p.default for p in element.parameters}
        assert propose(hopper(), element, [values], ()).faint == ()


def fitted_force(
    monkeypatch, proposal: Proposal, chi2: dict[float, float], felt: float = 1e-6
) -> tuple[float, list[float]]:
    """The force that a trial ends with, and those it was tried from, where a descent from a force ends with this chi2
    and a change of a parameter by `felt` shows."""
    tried: list[float] = []

    def descend(model, run, names, noise, starts, *_, **__) -> Descent:
        tried.append(model.value("coulomb_friction.force"))
        steps = np.full(len(names), felt), np.ones(run.states)
        return Descent(model, tuple(starts), (), chi2[tried[-1]], 64, True, "", (), steps, None)

    monkeypatch.setattr(refit, "descend", descend)
    monkeypatch.setattr(
        refit, "fork_map", lambda work, cases: [(i, work(case)) for i, case in enumerate(cases)]
    )
    start = np.array([0.15, 0.0])
    trials, excluded = run_trials([proposal], [STILL], [start], ("position", "velocity"), QUIET, 1e-3)
    assert not excluded
    return trials[0].model.value("coulomb_friction.force"), tried


def friction(ceiling: float) -> Proposal:
    guesses = [{"force": force, "transition": 0.02} for force in (0.5, 1.0)]
    return propose(hopper(), CATALOGUE["coulomb_friction"], guesses, (), ceiling)


def test_guesses_that_end_above_the_ceiling_are_followed_by_fainter_ones(monkeypatch):
    ends = {0.5: 900.0, 1.0: 800.0, 0.05: 150.0, 0.005: 90.0}
    assert fitted_force(monkeypatch, friction(100.0), ends) == (0.005, [0.5, 1.0, 0.05, 0.005])


def test_no_fainter_guess_is_tried_once_one_is_below_the_ceiling(monkeypatch):
    ends = {0.5: 900.0, 1.0: 800.0, 0.05: 95.0}
    assert fitted_force(monkeypatch, friction(100.0), ends) == (0.05, [0.5, 1.0, 0.05])
    assert fitted_force(monkeypatch, friction(math.inf), {0.5: 900.0, 1.0: 800.0}) == (1.0, [0.5, 1.0])


def test_parameters_that_have_wandered_to_where_nothing_shows_are_tried_again_from_the_first_guess(
    monkeypatch,
):
    ends = {0.5: 70.0, 1.0: 60.0}
    assert fitted_force(monkeypatch, friction(100.0), ends, felt=1.5) == (1.0, [0.5, 1.0, 0.5])
