"""Backward elimination tries chosen effects against being left out, and against others, as long as they may be named at all."""

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.diagnose.search import backward as module
from rhythmid.diagnose.search.round import Round
from rhythmid.diagnose.search.score_tests import Score
from rhythmid.diagnose.search.trial import Trial
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.series import Series

QUIET = NoiseModel(np.empty(0), 1.0)
TIME = 5e-3 * np.arange(2000)
SERIES = Series("made", TIME, np.sin(2 * np.pi * TIME), None, None, 1, np.ones(2000, bool), 5e-3)


@pytest.mark.parametrize(
    ("most", "others"), [(3, {"backlash", "quadratic_drag"}), (2, set())], ids=["may be named", "too many"]
)
def test_effects_are_exchanged_only_where_they_may_be_named(
    monkeypatch: pytest.MonkeyPatch, most: int, others: set[str]
):
    tried: list[tuple[str, ...]] = []

    def run_trials(proposals, *_, **__):
        tried.extend(p.added for p in proposals)
        return [], []

    monkeypatch.setattr(module, "run_trials", run_trials)
    monkeypatch.setattr(module, "under_noise", lambda trials, *_: list(trials))
    model = hopper().with_element(CATALOGUE["coulomb_friction"], {"force": 1.0})
    model = model.with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 10.0})
    best = Trial(
        ("coulomb_friction", "cubic_stiffness"), model, (), 100.0, 2000, len(model.free), True, QUIET
    )
    scored = {
        name: {p.name: 0.1 for p in CATALOGUE[name].parameters} for name in ("quadratic_drag", "backlash")
    }
    first = Round(tuple(Score(0, CATALOGUE[name], guess, 50.0, 1.0) for name, guess in scored.items()), 0.0)
    kept, _ = module.eliminate(
        best, [SERIES], CATALOGUE, {(): best}, QUIET, 1e-3, [first], 10.0, most, lambda _: None
    )
    assert kept is best
    assert {("coulomb_friction",), ("cubic_stiffness",)} <= set(tried)
    swapped = {name for added in tried if len(added) == 2 for name in added} - set(best.added)
    assert swapped == others
