"""Two laws that a damper of the nominal model hides are found together: alone each gains nothing, or has the wrong sign."""

from itertools import combinations

import numpy as np
import pytest
from synthetic import integrate, noisy, sign

from rhythmid.diagnose.search.forward import search
from rhythmid.diagnose.search.pair_scores import PairScore, pair_scores, thinned
from rhythmid.diagnose.search.proposals import pair_proposals
from rhythmid.diagnose.search.round import Round, changes_at, one_round
from rhythmid.diagnose.search.score_tests import Score, unexplained
from rhythmid.diagnose.search.trial import Trial
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
NOMINAL = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 400.0, unit: N/m}, rest_length: {value: 0.0, unit: m}}
  - viscous_damper: {damping: {value: 0.1, unit: N*s/m}}
"""
FRICTION, DRAG = 0.13, 0.35  # N, N s²/m²: over the decay, the damper fits their mean
HIDDEN = {"coulomb_friction", "quadratic_drag"}
NAMES = (*sorted(HIDDEN), "position_dependent_damping", "periodic_disturbance", "bilinear_stiffness")


def decay() -> Fit:
    """The nominal model, fitted to two releases of an oscillator with friction and drag."""
    rng, time = np.random.default_rng(3), np.arange(0.0, 9.0, 0.01)

    def rates(_: float, state: np.ndarray) -> list[float]:
        x, v = state
        return [v, -400.0 * x - 0.1 * v - FRICTION * sign(v, 1e-4) - DRAG * v * abs(v)]

    records = []
    for begin in (0.1, 0.098):
        x = integrate(rates, [begin, 0.0], time, 0.01)[:, 0]
        records.append(Record(f"from {begin}", Channel(time, noisy(rng, x, 3e-4), "m")))
    return estimate(Model.from_text(NOMINAL, catalogue=CATALOGUE), prepare(records))


def test_laws_that_a_damper_hides_score_together_what_neither_scores_alone():
    now, _ = one_round(decay(), (), {name: CATALOGUE[name] for name in NAMES}, None)
    alone = {one.element.name: one.statistic for one in reversed(now.scores)}
    best = now.pairs[0]
    assert set(best.names) == HIDDEN and best.first.size > 0.0 and best.second.size > 0.0
    assert best.statistic > 2.0 * max(alone[name] for name in HIDDEN)


def test_a_joint_score_is_what_a_linear_fit_of_both_changes_explains():
    fit = decay()
    tested = list(thinned(fit, changes_at(fit, {name: CATALOGUE[name] for name in HIDDEN}, None)))
    best = pair_scores(fit, tested)[0]
    columns = [
        next(change for one, change in tested if (one.element, one.values) == (half.element, half.values))
        for half in (best.first, best.second)
    ]
    residual = unexplained(fit)
    sizes, left, *_ = np.linalg.lstsq(np.column_stack(columns), -residual)
    assert best.statistic == pytest.approx(residual @ residual - left[0])
    assert (best.first.size, best.second.size) == pytest.approx(tuple(sizes))


def test_a_search_finds_both_laws_that_a_damper_hides():
    fit = decay()
    found = search(fit.run.series, fit, fit.model, {name: CATALOGUE[name] for name in NAMES}, None)
    assert set(found.best.added) == HIDDEN


def proposed(gained: float, known: str = "") -> list[set[str]]:
    """Pairs that are refitted of a round whose pairs score 300, 200 and 100, the parameters of each costing less than 50."""
    guesses = {
        "coulomb_friction": {"force": 0.1, "transition": 0.01},
        "quadratic_drag": {"coefficient": 0.1},
        "cubic_stiffness": {"coefficient": 1.0},
    }
    single = {name: Score(CATALOGUE[name], values, 0.0, 1.0) for name, values in guesses.items()}
    pairs = [
        PairScore(single[a], single[b], size)
        for (a, b), size in zip(combinations(single, 2), (300.0, 200.0, 100.0))
    ]
    model = Model.from_text(NOMINAL, catalogue=CATALOGUE)
    here = Trial((), model, (), 2000.0, 1000, len(model.free), True, NoiseModel(np.empty(0), 1.0))
    return [set(one.added) for one in pair_proposals(here, Round((), 1.0, pairs=tuple(pairs)), gained, known)]


def test_pairs_are_refitted_that_promise_more_than_one_effect_has_gained():
    every = [
        {"coulomb_friction", "quadratic_drag"},
        {"coulomb_friction", "cubic_stiffness"},
        {"quadratic_drag", "cubic_stiffness"},
    ]
    assert proposed(0.0) == every
    assert proposed(180.0) == every[:1]
    assert proposed(300.0) == []


def test_pairs_that_the_next_round_would_find_are_not_refitted():
    assert proposed(0.0, "cubic_stiffness") == [{"coulomb_friction", "quadratic_drag"}]
    assert proposed(0.0, "coulomb_friction") == []
