"""Backward elimination tries chosen effects against being left out, and against others in their place."""

import math
from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.search import backward as module
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.diagnose.search.trial import Proposal, Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import Series

QUIET = NoiseModel(np.empty(0), 1.0)
TIME = 5e-3 * np.arange(2000)
SERIES = Series("made", TIME, np.sin(2 * np.pi * TIME), None, None, 1, np.ones(2000, bool), 5e-3)


def trial(chi2: float, spring: float, **added: dict[str, float]) -> Trial:
    """The hopper with this stiffness and with elements of these values, as a fit ended."""
    model = hopper().with_values({"linear_spring.stiffness": spring})
    for name, values in added.items():
        model = model.with_element(CATALOGUE[name], values)
    return Trial(tuple(added), model, (), chi2, 2000, len(model.free), True, QUIET)


def proposed(monkeypatch: pytest.MonkeyPatch) -> list[Proposal]:
    """The models that the elimination tries, none of which is fitted."""
    tried: list[Proposal] = []

    def run_trials(proposals, *_, **__):
        tried.extend(proposals)
        return [], []

    monkeypatch.setattr(module, "run_trials", run_trials)
    monkeypatch.setattr(module, "under_noise", lambda trials, *_: list(trials))
    return tried


def test_effects_are_exchanged_for_those_that_scored_well_or_fit_well_alone(monkeypatch: pytest.MonkeyPatch):
    tried = proposed(monkeypatch)
    best = trial(100.0, 200.0, coulomb_friction={"force": 1.0}, cubic_stiffness={"coefficient": 10.0})
    alone = [
        trial(300.0, 150.0, quadratic_stiffness={"coefficient": 3.0}),
        trial(400.0, 160.0, cubic_stiffness={"coefficient": 20.0}),
        trial(900.0, 200.0, quintic_stiffness={"coefficient": 3.0}),  # others fit better
    ]
    scored = {
        name: {p.name: 0.1 for p in CATALOGUE[name].parameters} for name in ("quadratic_drag", "backlash")
    }
    first = Round(tuple(Score(CATALOGUE[name], guess, 50.0, 1.0) for name, guess in scored.items()), 0.0)
    trials = {one.added: one for one in (best, *alone)}
    kept, _ = module.eliminate(
        best, [SERIES], CATALOGUE, trials, QUIET, 1e-3, [first], 10.0, math.inf, lambda _: None
    )
    assert kept is best
    assert {("coulomb_friction",), ("cubic_stiffness",)} <= {one.added for one in tried}
    swapped = {name for one in tried if len(one.added) == 2 for name in one.added} - set(best.added)
    assert swapped == {"backlash", "quadratic_drag", "quadratic_stiffness"}
    # what fits well alone begins where it did, with the values that the model had beside it
    (gone,) = (one for one in tried if one.added == ("coulomb_friction", "quadratic_stiffness"))
    assert gone.guesses[0]["quadratic_stiffness.coefficient"] == 3.0
    assert gone.guesses[0]["linear_spring.stiffness"] == 150.0


def test_what_scored_well_begins_where_it_ended_alone_though_others_fit_better(
    monkeypatch: pytest.MonkeyPatch,
):
    """A pendulum's gravity added to a spring that contains it already ends in another minimum."""
    tried = proposed(monkeypatch)
    best = trial(100.0, 200.0, coulomb_friction={"force": 1.0}, cubic_stiffness={"coefficient": 10.0})
    alone = [
        trial(300.0, 150.0, quintic_stiffness={"coefficient": 3.0}),
        trial(400.0, 160.0, quadratic_drag={"coefficient": 0.1}),
        trial(900.0, 5.0, quadratic_stiffness={"coefficient": 3.0}),
    ]
    first = Round((Score(CATALOGUE["quadratic_stiffness"], {"coefficient": 0.1}, 50.0, 1.0),), 0.0)
    trials = {one.added: one for one in (best, *alone)}
    module.eliminate(best, [SERIES], CATALOGUE, trials, QUIET, 1e-3, [first], 10.0, math.inf, lambda _: None)
    (made,) = (one for one in tried if one.added == ("coulomb_friction", "quadratic_stiffness"))
    assert made.guesses[0]["quadratic_stiffness.coefficient"] == 3.0
    assert made.guesses[0]["linear_spring.stiffness"] == 5.0


def test_what_an_exchange_makes_idle_is_left_out(monkeypatch: pytest.MonkeyPatch):
    ends = {
        ("coulomb_friction", "quadratic_drag"): trial(
            50.0, 200.0, coulomb_friction={"force": 1.0}, quadratic_drag={"coefficient": 0.1}
        ),
        ("quadratic_drag",): trial(51.0, 200.0, quadratic_drag={"coefficient": 0.1}),
    }

    def run_trials(proposals, *_, **__):
        return [ends[key] for p in proposals if (key := tuple(sorted(p.added))) in ends], []

    monkeypatch.setattr(module, "run_trials", run_trials)
    monkeypatch.setattr(module, "under_noise", lambda trials, *_: list(trials))
    best = trial(100.0, 200.0, coulomb_friction={"force": 1.0}, cubic_stiffness={"coefficient": 10.0})
    guess = {p.name: 0.1 for p in CATALOGUE["quadratic_drag"].parameters}
    first = Round((Score(CATALOGUE["quadratic_drag"], guess, 50.0, 1.0),), 0.0)
    kept, _ = module.eliminate(
        best, [SERIES], CATALOGUE, {best.added: best}, QUIET, 1e-3, [first], 10.0, math.inf, lambda _: None
    )
    assert kept.added == ("quadratic_drag",)


def test_models_with_one_effect_are_compared_under_one_noise(monkeypatch: pytest.MonkeyPatch):
    tried = []
    later = {
        "quadratic_stiffness": 2000.0,
        "quintic_stiffness": 2500.0,
        "cubic_stiffness": 3000.0,
        "bilinear_stiffness": 4000.0,
    }

    def run_trials(proposals, *_, **__):
        tried.extend(proposals)
        return [], []

    def under_noise(trials, *_):
        level = [replace(one, chi2=later[one.added[0]]) for one in trials if one.added[0] in later]
        return sorted(level, key=lambda one: one.chi2)

    monkeypatch.setattr(module, "run_trials", run_trials)
    monkeypatch.setattr(module, "under_noise", under_noise)
    best = trial(100.0, 200.0, coulomb_friction={"force": 1.0}, quadratic_drag={"coefficient": 0.1})
    alone = [  # the first two were fitted again under the noise that a better model leaves
        trial(2000.0, 150.0, quadratic_stiffness={"coefficient": 3.0}),
        trial(2500.0, 150.0, quintic_stiffness={"coefficient": 3.0}),
        trial(300.0, 150.0, cubic_stiffness={"coefficient": 3.0}),
        trial(
            400.0, 150.0, bilinear_stiffness={p.name: 0.1 for p in CATALOGUE["bilinear_stiffness"].parameters}
        ),
    ]
    trials = {one.added: one for one in (best, *alone)}
    first = Round((), 0.0)
    module.eliminate(best, [SERIES], CATALOGUE, trials, QUIET, 1e-3, [first], 10.0, math.inf, lambda _: None)
    swapped = {name for one in tried if len(one.added) == 2 for name in one.added} - set(best.added)
    assert {"quadratic_stiffness", "quintic_stiffness"} <= swapped
    assert not {"cubic_stiffness", "bilinear_stiffness"} & swapped
