"""What a force does to a free run is taken from a part so small that the answer is in proportion to it."""

import numpy as np
import pytest

from rhythmid.diagnose.search import response as module
from rhythmid.diagnose.search.response import response
from rhythmid.diagnose.search.score_tests import Trajectories, trajectories
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.simulate import simulate

PENDULUM = """
units: {force: "rad/s^2", position: rad, mass: "1"}
inertia: {mass: {value: 1, unit: "1", fixed: true}}
force:
  - pendulum_gravity: {moment: {value: 36.0, unit: "rad/s^2"}, reference: {value: 0.0, unit: rad, fixed: true}}
  - viscous_damper: {damping: {value: 0.03, unit: "rad/s^2*s/rad"}}
"""


@pytest.fixture(scope="module")
def swinging() -> Trajectories:
    """A pendulum that swings down from 1.6 rad over a hundred cycles."""
    model = Model.from_text(PENDULUM, catalogue=load_catalogue())
    time = np.arange(0.0, 110.0, 0.03)
    value = simulate(model, time, initial=(1.6, 0.0)).output
    value = value + 1e-3 * np.random.default_rng(0).standard_normal(len(time))
    return trajectories(estimate(model, prepare([Record("decay", Channel(time, value, "rad"))])))


def friction(known: Trajectories) -> np.ndarray:
    return -0.03 * np.tanh(known.paths[0].velocity / 0.05)


def apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.linalg.norm(first - second) / np.linalg.norm(second))


def test_over_a_hundred_free_cycles_the_answer_is_that_to_a_tiny_force(swinging, monkeypatch):
    made = response(swinging, 0, friction(swinging))
    monkeypatch.setattr(module, "SMALL", 1e-7)
    tiny = response(swinging, 0, friction(swinging))
    assert made is not None and tiny is not None and apart(made, tiny) < 0.05
    monkeypatch.setattr(module, "SMALL", 1e-3)
    monkeypatch.setattr(module, "ATTEMPTS", 1)
    rough = response(swinging, 0, friction(swinging))
    assert rough is not None and apart(rough, tiny) > 0.2  # a part that is too large tells something else


def test_twice_the_force_does_twice_as_much_and_none_does_nothing(swinging):
    once, twice = (response(swinging, 0, share * friction(swinging)) for share in (1.0, 2.0))
    assert once is not None and twice is not None and apart(twice, 2.0 * once) < 0.05
    none = response(swinging, 0, np.zeros(len(friction(swinging))))
    assert none is not None and not none.any()
