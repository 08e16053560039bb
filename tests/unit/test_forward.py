"""The forward search grants effects as long as each is worth its parameters beside what the others have explained."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.case import Budget
from rhythmid.diagnose.search import forward as module
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.diagnose.search.trial import Proposal, Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import Series

QUIET = NoiseModel(np.empty(0), 1.0)
TIME = 5e-3 * np.arange(2000)
SERIES = Series("made", TIME, np.sin(2 * np.pi * TIME), None, None, 1, np.ones(2000, bool), 5e-3)
CHI2 = 1e6  # of the nominal model
ORDER = ("coulomb_friction", "cubic_stiffness", "quadratic_drag")  # in which the effects score
VALUES = ({"force": 1.0, "transition": 0.01}, {"coefficient": 10.0}, {"coefficient": 1.0})


MISLEADING = ("actuator_lag", "sensor_lag", "command_lag", "actuator_rate_limit", "input_delay_drift")


def found(
    monkeypatch: pytest.MonkeyPatch, *gains: float, local: bool = False, misleading: int = 0
) -> tuple[str, ...]:
    """The effects that a search grants, of which each lowers chi2 by its gain, once the ones before it are there.

    All score along the whole records, or only in windows of them where `local`. So many `misleading` elements score better than the first
    effect, and do worse.
    """

    def fitted(trial: Any, *_: Any, **__: Any) -> Any:
        run = SimpleNamespace(
            series=(), max_step=1e-3, compiled=SimpleNamespace(layout=SimpleNamespace(states=()))
        )
        differences = (np.ones(1), np.ones(1))
        return SimpleNamespace(
            model=trial.model, chi2=trial.chi2, samples=2000, starts=(), names=trial.model.free, converged=True, noise=QUIET,
            run=run, residuals=(), differences=differences, nrmse=lambda: 0.2,
        )  # fmt: skip

    def one_round(fit: Any, added: tuple[str, ...], *_: Any) -> tuple[Round, Any]:
        place = len(added)
        scores = [Score(CATALOGUE[ORDER[place]], VALUES[place], 1e3, 1.0)] if place < len(gains) else []
        kin = [CATALOGUE[name] for name in MISLEADING[: 0 if place else misleading]]
        scores = [*(Score(one, {p.name: 0.01 for p in one.parameters}, 2e3, 1.0) for one in kin), *scores]
        if local:
            return Round((), 1.0, added, tuple(scores)), fit
        return Round(tuple(scores), 0.0 if scores else 1.0, added), fit

    def run_trials(proposals: list[Proposal], *_: Any, **__: Any) -> tuple[list[Trial], list[Any]]:
        made = [
            Trial(
                one.added, one.model, (), CHI2 + 1.0 if one.added[-1] in MISLEADING else CHI2 - sum(gains[: len(one.added)]),
                2000, len(one.model.free), True, QUIET,
            )
            for one in proposals
        ]  # fmt: skip
        return made, []

    def by_criterion(trials: Any, *_: Any, **__: Any) -> list[Trial]:
        return sorted(trials, key=lambda trial: trial.bic())

    replaced = {
        "one_round": one_round, "run_trials": run_trials, "whole_fit": fitted, "under_noise": by_criterion,
        "near_under_noise": by_criterion, "in_best_order": lambda trial, *_: trial, "noise_of": lambda *_: QUIET,
        "eliminate": lambda best, *_: (best, {}), "felt_starts": lambda *_: None, "start_cost": lambda _: 0.0,
        "under": lambda fit, *_: fit, "not_tried": lambda *_: [], "could_pay": lambda *_: True,
        "Origin": SimpleNamespace(of=lambda trial: None), "fine_enough": lambda run, *_: run,
        "reach_of": lambda *_: np.inf,
    }  # fmt: skip
    for name, fake in replaced.items():
        monkeypatch.setattr(module, name, fake)
    nominal = fitted(SimpleNamespace(model=hopper(), chi2=CHI2))
    return module.search([SERIES], nominal, hopper(), CATALOGUE, None, budget=Budget()).best.added


def test_effects_are_granted_one_after_the_other_up_to_three(monkeypatch):
    assert found(monkeypatch, 2e5, 5e4, 1e4) == ORDER


def test_an_effect_that_shows_in_windows_only_is_refitted_and_granted(monkeypatch):
    assert found(monkeypatch, 2e5, 5e4, local=True) == ORDER[:2]


@pytest.mark.parametrize(("gain", "granted"), [(60.0, 1), (250.0, 2)])
def test_a_further_effect_has_to_gain_more_than_a_small_share_of_what_is_explained_already(
    monkeypatch, gain, granted
):
    assert found(monkeypatch, 2e5, gain) == ORDER[:granted]  # 100 is the share of 200 000


@pytest.mark.parametrize(("gain", "granted"), [(20.0, 0), (60.0, 1)])
def test_the_first_effect_has_to_gain_more_than_a_difference_that_tells_nothing(monkeypatch, gain, granted):
    # its two parameters cost 15 of the criterion
    assert found(monkeypatch, gain) == ORDER[:granted]


@pytest.mark.parametrize("misleading", [0, 3, 4, 5])
def test_an_effect_is_found_behind_others_that_score_better_and_do_worse(monkeypatch, misleading):
    assert found(monkeypatch, 2e5, misleading=misleading) == ORDER[:1]
