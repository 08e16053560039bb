"""A rest counts against a model that would move the machine there, and against no other."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from axes import CATALOGUE, axis_model

from rhythmid.diagnose.constants import BLOCK_ODDS
from rhythmid.diagnose.effort.search import search_effort
from rhythmid.diagnose.evidence import Blocks, odds_of_rests, predict, with_trusted_rests
from rhythmid.diagnose.hypothesis import Prediction
from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.rest_force import STATIC
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

RATE, FRICTION, DAMPING = 100.0, 0.8, 2.0  # [Hz], [N], [N s/m]


@lru_cache
def carriage(
    far: float = 1.0, held: float = 0.0, friction: float = FRICTION, weight: float = 0.0, seed: int = 0
) -> Record:
    """A mass of 1 kg with damping, friction and a constant force `weight` that moves upwards by `far` [m] in an uneven way, within
    6 s, and rests before it for 3 s and after it for 8 s; the effort at rest is `held`."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(17.0 * RATE)) / RATE
    moves = (time > 3.0) & (time < 9.0)
    s = np.clip((time - 3.0) / 6.0, 0.0, 1.0)
    speed = np.where(
        moves, np.sin(np.pi * s) ** 2 * (1.0 + 0.6 * np.sin(2.0 * np.pi * (3.0 * s + rng.random()))), 0.0
    )
    speed *= far / (np.sum(speed) / RATE)
    position = np.cumsum(speed) / RATE
    effort = np.where(moves, np.gradient(speed) * RATE + DAMPING * speed + friction - weight, held)
    effort = effort + 0.01 * rng.standard_normal(len(time))
    position = position + 1e-5 * rng.standard_normal(len(time))
    return Record(f"carriage {seed}", Channel(time, position, "m"), Channel(time, effort, "N"), hold="linear")


def pair(**known: float) -> list[Record]:
    """Two records, of which the second goes farther."""
    return [carriage(1.0, **known), carriage(1.4, seed=1, **known)]


def with_force(name: str, **values: float) -> Model:
    return axis_model().with_element(CATALOGUE[name], values)


@lru_cache
def balance_of(**known: float) -> Balance:
    return Balance.of(pair(**known), axis_model())


def unbalanced(model: Model, **known: float) -> list[float]:
    """Mean excess at the start and the end of the first record, then at those of the second."""
    return [float(np.mean(one)) for one in balance_of(**known).rests.excess(model)]


def test_a_constant_force_is_not_balanced_at_rest_where_the_machine_is_free_to_yield():
    first, end, second, far_end = unbalanced(with_force("constant_force", force=-FRICTION))
    assert [end, far_end] == pytest.approx([-FRICTION] * 2, abs=0.12)
    assert first == second == 0.0  # below the start it was never seen: a stop may hold it there


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction", {"force": FRICTION, "transition": 0.1}),
        ("stribeck_friction", {"force": FRICTION, "static_ratio": 1.0, "stribeck_speed": 0.05, "transition": 0.1}),
        ("elastoplastic_hysteresis", {"stiffness": FRICTION / 0.01, "yield_displacement": 0.01}),
        ("bouc_wen_hysteresis", {"stiffness": FRICTION / 0.01, "yield_displacement": 0.01, "shape": 0.5}),
    ],
)  # fmt: skip
def test_friction_balances_efforts_within_it_and_no_others(name, values):
    model = with_force(name, **values)
    for held in (0.0, 0.7, -0.7):
        assert unbalanced(model, held=held) == pytest.approx([0.0] * 4, abs=0.02)
    assert unbalanced(model, held=1.4) == pytest.approx([0.0] * 4, abs=0.02)  # static friction is larger
    assert unbalanced(model, held=2.0)[:3] == pytest.approx([2.0 - STATIC * FRICTION] * 3, abs=0.15)


def test_a_dead_band_makes_no_force_of_an_effort_within_it():
    model = with_force("actuator_deadband", threshold=FRICTION)
    assert unbalanced(model, held=0.7) == pytest.approx([0.0] * 4, abs=0.02)
    assert min(unbalanced(model, held=1.6)[:3]) > 0.5


def test_without_friction_the_effort_at_rest_must_be_the_required_one():
    assert unbalanced(axis_model(), held=0.0) == pytest.approx([0.0] * 4, abs=0.03)
    assert unbalanced(axis_model(), held=0.7)[:3] == pytest.approx([0.7] * 3, abs=0.12)


def test_rests_of_a_machine_on_a_moving_base_do_not_count():
    balance = balance_of()
    moved = replace(balance, motions=tuple(replace(one, driven_by_base=True) for one in balance.motions))
    assert balance.rests.found and not moved.rests.found


def test_a_long_rest_counts_as_one_sample_whose_odds_are_limited():
    short, long = (odds_of_rests([np.full(count, 1.5)], 1.0) for count in (10, 10_000))
    assert short == pytest.approx(long) and short < -0.5
    assert odds_of_rests([np.zeros(10), np.full(10, 1e6)], 1.0) == pytest.approx([0.0, -math.log(BLOCK_ODDS)])


def test_rests_count_in_the_evidence_against_a_constant_force_and_not_against_friction():
    two = ("constant_force", "coulomb_friction")
    only = CATALOGUE.without(*(name for name in CATALOGUE if name not in two))
    found = search_effort(pair(), axis_model(), only, most=1)
    fits = {one.elements: one.linearised for one in found.hypotheses}
    made = [fits[name,] for name in two]
    of_force, of_friction = predict(made, found.blocks, found.balance.record)
    count = found.blocks.count
    np.testing.assert_array_equal(of_friction.log_density[count:], 0.0)
    odds = math.log(BLOCK_ODDS)
    np.testing.assert_allclose(of_force.log_density[count:], [0.0, -odds, 0.0, -odds])
    assert of_force.samples[count:].sum() == of_force.squared_error[count:].sum() == 0.0
    assert found.chosen.elements == ("coulomb_friction",)


def test_a_constant_force_that_a_controller_balances_at_rest_is_still_found():
    three = ("constant_force", "coulomb_friction", "quadratic_drag")
    only = CATALOGUE.without(*(name for name in CATALOGUE if name not in three))
    found = search_effort(pair(friction=0.0, weight=-FRICTION, held=FRICTION), axis_model(), only)
    assert found.chosen.elements == ("constant_force",)


def predicted(motion: list[float], rests: list[float]) -> Prediction:
    count = np.concatenate([np.full(len(motion), 20.0), np.zeros(len(rests))])
    return Prediction(np.array([*motion, *rests]), count, count)


@pytest.mark.parametrize(("ahead", "counted"), [([0.5, -0.4] * 6, True), ([0.9, 0.7] * 6, False)])
def test_rests_decide_only_where_the_motion_does_not(ahead, counted):
    """If a hypothesis that would move the machine predicts the motion far better than any other, a brake may hold the machine."""
    blocks = Blocks.of(np.zeros(150, dtype=np.int64))
    ahead = ahead[: blocks.count]
    moves, holds = predicted(ahead, [-3.0, -3.0]), predicted([0.0] * blocks.count, [0.0, 0.0])
    free_map = predicted([5.0] * blocks.count, [math.nan] * 2)
    first, second, third = with_trusted_rests([moves, holds, free_map], blocks)
    assert first.log_density[blocks.count :].sum() == (-6.0 if counted else 0.0)
    assert second.score == holds.score and third.score == 5.0 * blocks.count
