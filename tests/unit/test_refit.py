"""Refits of candidates: where the first guesses of an element lead away, fainter ones are tried."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.search import refit
from rhythmid.diagnose.search.refit import run_trials
from rhythmid.diagnose.search.trial import Origin, Proposal, Trial, propose
from rhythmid.identify.descent import Descent, out_of_reach
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit
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


def reach_over(error) -> float:
    """The chi2 that a model needs to compete with one that leaves these errors."""
    run = SimpleNamespace(
        series=[replace(STILL, time=np.arange(len(error)), value=error, used=np.ones(len(error), bool))]
    )
    return refit.reach_of(cast(Fit, SimpleNamespace(run=run, residuals=[error])), QUIET)


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
    trials, excluded = run_trials(
        [proposal], [STILL], Origin((start,), ("position", "velocity")), QUIET, 1e-3
    )
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


def test_a_flat_parameter_of_a_close_model_is_tried_from_all_guesses_and_fainter_ones_and_the_best_is_kept(
    monkeypatch,
):
    """As in a lag whose time ended where nothing shows: the element's own guesses bring it back."""
    element = CATALOGUE["coulomb_friction"]
    lost = hopper().with_element(element, {"force": 1e-9, "transition": 0.02})
    tried: list[float] = []

    def descend(model, run, names, noise, starts, *_, **__) -> Descent:
        tried.append(model.value("coulomb_friction.force"))
        steps = np.full(len(names), 1e-6), np.ones(run.states)
        chi2 = 100.0 + abs(math.log(tried[-1] / 1e-3))
        return Descent(model, tuple(starts), (), chi2, 64, True, "", (), steps, None)

    monkeypatch.setattr(refit, "descend", descend)
    steps = np.full(len(lost.free), 1e-6), np.ones(2)
    start = (np.array([0.15, 0.0]),)
    trial = Trial(("coulomb_friction",), lost, start, 500.0, 64, len(lost.free), True, QUIET, steps)
    found = refit._unstuck(trial, [STILL], 1e-3)
    assert tried and found.chi2 == pytest.approx(min(100.0 + abs(math.log(one / 1e-3)) for one in tried))
    assert found.model.value("coulomb_friction.force") == min(
        tried, key=lambda one: abs(math.log(one / 1e-3))
    )
    near = replace(
        trial, model=lost.with_values({"coulomb_friction.force": 0.5, "coulomb_friction.transition": 0.02})
    )
    tried.clear()
    assert refit._unstuck(near, [STILL], 1e-3) is near and not tried


def test_a_parameter_with_many_minima_is_followed_to_the_deepest_from_one_to_the_next(monkeypatch):
    """Minima a second apart, each half as deep as the next one towards the true time of 7 s."""
    element = CATALOGUE["stiffness_jump"]

    def descend(model, run, names, noise, starts, *_, **__) -> Descent:
        time = round(model.value("stiffness_jump.time"))
        steps = np.full(len(names), 1e-6), np.ones(run.states)
        end = model.with_values({"stiffness_jump.time": float(time)})
        return Descent(end, tuple(starts), (), 100.0 + 50.0 * abs(time - 7), 64, True, "", (), steps, None)

    monkeypatch.setattr(refit, "descend", descend)
    monkeypatch.setattr(
        refit, "fork_map", lambda work, cases: [(i, work(case)) for i, case in enumerate(cases)]
    )
    stepwise = replace(element, hops=lambda s: {"time": 1.0})
    proposal = propose(hopper(), stepwise, [{"change": 0.01, "time": 3.0}], (), 1000.0)
    trials, _ = run_trials(
        [proposal], [STILL], Origin((np.array([0.15, 0.0]),), ("position", "velocity")), QUIET, 1e-3
    )
    assert trials[0].model.value("stiffness_jump.time") == 7.0


def test_of_models_that_fit_alike_the_first_proposed_comes_first_whichever_worker_finishes_first(monkeypatch):
    def descend(model, run, names, noise, starts, *_, **__) -> Descent:
        steps = np.full(len(names), 1e-9), np.ones(run.states)
        return Descent(model, tuple(starts), (), 100.0, 64, True, "", (), steps, None)

    monkeypatch.setattr(refit, "descend", descend)
    sizes = {"constant_force": {"force": 0.1}, "quadratic_damping": {"coefficient": 0.1}}
    made = [propose(hopper(), CATALOGUE[name], [size], ()) for name, size in sizes.items()]
    origin = Origin((np.array([0.15, 0.0]),), ("position", "velocity"))
    for order in (list, reversed):
        monkeypatch.setattr(
            refit, "fork_map", lambda work, cases, order=order: [(i, work(cases[i])) for i in order(range(len(cases)))]
        )  # fmt: skip
        trials, _ = run_trials(made, [STILL], origin, QUIET, 1e-3)
        assert [trial.added for trial in trials] == [(name,) for name in sizes]


def test_what_a_guess_fixes_is_kept_with_what_was_fitted_from_it(monkeypatch):
    """As the side of a stop: a position fitted for the upper one means nothing for the lower one."""
    element = CATALOGUE["end_stop_contact"]

    def descend(model, run, names, noise, starts, *_, **__) -> Descent:
        steps = np.full(len(names), 1e-9), np.ones(run.states)
        chi2 = 100.0 if model.value("end_stop_contact.side") > 0.0 else 900.0
        return Descent(model, tuple(starts), (), chi2, 64, True, "", (), steps, None)

    monkeypatch.setattr(refit, "descend", descend)
    monkeypatch.setattr(
        refit, "fork_map", lambda work, cases: [(i, work(case)) for i, case in enumerate(cases)]
    )
    shape = {"stiffness": 100.0, "damping_ratio": 0.1}
    guesses = [shape | {"position": 0.1, "side": -1.0}, shape | {"position": 0.2, "side": 1.0}]
    proposal = propose(hopper(), element, guesses, (), 1000.0)
    trials, _ = run_trials(
        [proposal], [STILL], Origin((np.array([0.15, 0.0]),), ("position", "velocity")), QUIET, 1e-3
    )
    found = trials[0].model
    assert (found.value("end_stop_contact.position"), found.value("end_stop_contact.side")) == (0.2, 1.0)
    assert trials[0].free == len(found.free)


@pytest.mark.parametrize(("falls", "arrives"), [(0.5, True), (0.9, False)])
def test_a_descent_that_still_falls_steeply_goes_on_where_others_have_been_left(monkeypatch, falls, arrives):
    """One in a bent valley, far above the best at first; a descent that creeps is left after a few iterations."""
    left: list[int] = []

    def descend(model, run, names, noise, starts, iterations=30, *_, **__) -> Descent:
        """From the size of a force on, each iteration takes off the same share; converged below a thousandth."""
        left.append(iterations)
        force = model.value("coulomb_friction.force") * falls ** (iterations / refit.SKETCH)
        end = model.with_values({"coulomb_friction.force": force})
        steps = np.full(len(names), 1e-6), np.ones(run.states)
        return Descent(end, tuple(starts), (), 1e5 * force, 64, force < 0.05, "", (), steps, None)

    monkeypatch.setattr(refit, "descend", descend)
    run = refit.prepare_run(friction(100.0).model, [STILL], 1e-3)
    start = descend(
        friction(100.0).model, run, ("coulomb_friction.force",), QUIET, [np.zeros(2)], refit.SKETCH
    )
    end = refit._carried_on(start, run, QUIET)
    assert end.converged == arrives
    assert sum(left) <= refit.THOROUGH + refit.SKETCH
    assert arrives or sum(left) == refit.BRIEF


def test_a_descent_that_would_not_come_to_where_it_matters_is_given_up() -> None:
    assert not out_of_reach(100.0, 50.0, 4.0, 4.0)  # halved four times more: 3.1
    assert out_of_reach(100.0, 50.0, 3.0, 4.0)
    assert not out_of_reach(100.0, 99.0, 0.0, 100.0)  # there already


def test_a_model_competes_if_it_is_less_than_five_standard_errors_behind() -> None:
    noise = np.random.default_rng(0).normal(size=6400)
    white = reach_over(noise)
    assert white == pytest.approx(noise @ noise + 100.0, rel=1e-2)
    # errors that last for eight samples are an eighth as many
    lasting = np.repeat(noise[:800], 8)
    assert reach_over(lasting) == pytest.approx(lasting @ lasting + 800.0, rel=0.1)
