"""What a force does to a free run: the answer is that to a force which is as small as can be."""

from dataclasses import replace

import numpy as np
import pytest

from rhythmid.diagnose.free_functions import free_functions
from rhythmid.diagnose.search.score_tests import Trajectories, trajectories
from rhythmid.diagnose.search.tangent import Tangent
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.descent import WHITE
from rhythmid.identify.output_error import estimate, start_only
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import first_order_hold
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


def by_difference(known: Trajectories, force: np.ndarray, share: float) -> np.ndarray:
    """What a small part of a force does to a run, scaled back."""
    fit, run = known.fit, known.disturbed
    rows = run.rows(fit.model, 0, fit.starts[0], first_order_hold(known.paths[0].time, share * force))
    assert rows is not None
    return (rows[:, run.states] - known.paths[0].signal) / share


def test_over_a_hundred_free_cycles_the_answer_is_that_to_a_tiny_force(swinging):
    made = swinging.response(0, friction(swinging))
    assert made is not None and apart(made, by_difference(swinging, friction(swinging), 1e-6)) < 0.01
    rough = by_difference(swinging, friction(swinging), 1.0)
    assert apart(made, rough) > 0.2  # a part that is too large tells something else


@pytest.mark.parametrize(
    "elements",
    [
        "force: [{linear_spring: {stiffness: {value: 200.0, unit: N/m}}}, "
        "{elastoplastic_hysteresis: {stiffness: {value: 300.0, unit: N/m}, yield_displacement: {value: 0.003, unit: m}}}]",
        "actuator: [{backlash: {width: {value: 0.3, unit: N}}}]\n"
        "force: [{linear_spring: {stiffness: {value: 200.0, unit: N/m}}}]",
        "force: [{linear_spring: {stiffness: {value: 200.0, unit: N/m}}}]\n"
        "sensor: [{sensor_lag: {time_constant: {value: 0.02, unit: s}}}]",
    ],
    ids=["state", "memory", "sensor"],
)
@pytest.mark.parametrize("measured", ["position", "velocity", "acceleration"])
def test_the_answer_of_a_driven_machine_is_that_to_a_tiny_force_whatever_is_measured(elements, measured):
    unit = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}[measured]
    text = f"inertia: {{mass: {{value: 1.0, unit: kg}}}}\n{elements}\n"
    text = text.replace("force: [", "force: [{viscous_damper: {damping: {value: 1.5, unit: N*s/m}}}, ")
    model = Model.from_text(text, catalogue=load_catalogue())
    time = np.arange(0.0, 6.0, 0.005)
    rng = np.random.default_rng(1)
    series = prepare(
        [
            Record(
                "driven",
                output=Channel(time, 0.1 * rng.standard_normal(len(time)), unit),
                input=Channel(time, 2.0 * np.sin(9.0 * time + 2.0 * np.sin(time)), "N"),
                hold="zero",
                output_kind=measured,
            )
        ]
    )
    fit = start_only(model, series, WHITE, 0.005)
    known = trajectories(fit)
    force = rng.standard_normal(len(known.paths[0].time))
    made = known.response(0, force)
    assert known.tangents[0] is not None
    assert made is not None and apart(made, by_difference(known, force, 1e-6)) < 0.01


def test_a_machine_that_keeps_a_history_answers_to_a_small_force():
    """Its feedback acts on what was measured a while ago, which is no state."""
    text = """
units: {force: "rad/s^2", position: rad, mass: "1"}
inertia: {mass: {value: 1, unit: "1", fixed: true}}
command:
  - feedback_delay: {delay: {value: 0.02, unit: s}}
  - position_control: {proportional: {value: 100.0, unit: "1/s^2"}, derivative: {value: 8.0, unit: "1/s"}}
"""
    model = Model.from_text(text, catalogue=load_catalogue())
    time = np.arange(0.0, 6.0, 0.01)
    record = Record(
        "servo",
        output=Channel(time, np.zeros(len(time)), "rad"),
        input=Channel(time, np.sin(3.0 * time), "rad"),
        input_kind="reference",
    )
    known = trajectories(start_only(model, prepare([record]), WHITE, 0.005))
    force = np.sin(5.0 * known.paths[0].time)
    made = known.response(0, force)
    assert known.tangents == (None,)
    assert made is not None and apart(made, by_difference(known, force, 1e-4)) < 0.02


def test_twice_the_force_does_twice_as_much_and_none_does_nothing(swinging):
    once, twice = (swinging.response(0, share * friction(swinging)) for share in (1.0, 2.0))
    assert once is not None and twice is not None and apart(twice, 2.0 * once) < 0.05
    none = swinging.response(0, np.zeros(len(friction(swinging))))
    assert none is not None and not none.any()


def test_an_answer_whose_squares_would_overflow_is_none(swinging):
    count = len(swinging.paths[0].time)
    maps = np.zeros(
        (count - 1, 3, 4)
    )  # grows to 1e160: finite, as of a machine that is too stiff for the step
    maps[:, 0, 0] = maps[:, 2, 0] = 10.0 ** (160.0 / count)
    maps[:, 0, 2] = 1.0
    stiff = replace(swinging)
    stiff.__dict__["tangents"] = (Tangent(maps, 0.0),)
    assert 1e150 < np.abs(stiff.tangents[0].response(np.ones(count))).max() < np.inf
    assert stiff.response(0, np.ones(count)) is None
    assert not np.any(next(free_functions(stiff)).columns)
