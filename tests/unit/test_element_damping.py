"""Damping against closed forms and an independent integrator."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp


def test_quadratic_drag_lets_a_mass_coast_as_one_over_time(rig):
    run = rig.run(rig.model("quadratic_drag", {"coefficient": 0.8}, mass=2.0), 2.0, (0.0, -3.0))
    assert run.velocity == pytest.approx(-3.0 / (1 + 0.8 * 3.0 * run.time / 2.0), rel=1e-9)


def test_viscous_damper_lets_a_mass_coast_exponentially(rig):
    run = rig.run(rig.model("viscous_damper", {"damping": 0.8}, mass=2.0), 2.0, (0.0, -3.0))
    assert run.velocity == pytest.approx(-3.0 * np.exp(-0.8 * run.time / 2.0), rel=1e-9)


def test_flight_damping_acts_on_the_way_down_only(rig):
    damping, stiffness = 2.0, 100.0
    run = rig.run(rig.model("flight_damping", {"damping": damping}, spring=stiffness), 0.7, (0.1, 0.0))
    ratio = damping / (2 * math.sqrt(stiffness))
    bottom = -0.1 * math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))
    assert run.position.min() == pytest.approx(bottom, rel=1e-4)
    after = run.position[np.argmin(run.position) :]
    assert after.max() == pytest.approx(-bottom, rel=1e-4)  # undamped on the way up


@pytest.mark.parametrize("threshold", [0.15, -0.1])
def test_switching_threshold_moves_the_switch_of_the_nominal_damper(rig, threshold):
    stance, flight = 4.0, 1.0
    model = rig.model(
        "switching_threshold",
        {"threshold": threshold, "transition": 2e-3},
        spring=100.0,
        stance=stance,
        flight=flight,
    )
    run = rig.run(model, 0.9, (0.05, 0.0))

    def plain(t, s):
        return [s[1], -100.0 * s[0] - (stance if s[1] > threshold else flight) * s[1]]

    exact = solve_ivp(plain, (0, 0.9), [0.05, 0.0], t_eval=run.time, max_step=2e-4, rtol=1e-8, atol=1e-10)
    without = solve_ivp(
        lambda t, s: [s[1], -100.0 * s[0] - (stance if s[1] > 0 else flight) * s[1]],
        (0, 0.9), [0.05, 0.0], t_eval=run.time, max_step=2e-4,
    )  # fmt: skip
    assert np.abs(run.position - exact.y[0]).max() < 0.01 * np.abs(without.y[0] - exact.y[0]).max()


def test_a_switch_is_no_wider_than_half_its_threshold(rig):
    def run(transition):
        values = {"threshold": 0.1, "transition": transition}
        return rig.run(
            rig.model("switching_threshold", values, spring=100.0, stance=4.0, flight=1.0), 0.9, (0.05, 0.0)
        )

    assert np.array_equal(run(10.0).position, run(0.05).position)
    assert np.abs(run(0.05).position - run(0.02).position).max() > 1e-6


@pytest.mark.parametrize("exponent", [1, 2])
def test_position_dependent_damping_takes_speed_by_the_way_travelled(rig, exponent):
    values = {"coefficient": 3.0, "reference": -0.2, "exponent": exponent}
    run = rig.run(rig.model("position_dependent_damping", values, mass=2.0), 1.5, (0.1, 0.8))
    power = exponent + 1
    lost = 3.0 * ((run.position + 0.2) ** power - 0.3**power) / (power * 2.0)
    assert run.velocity == pytest.approx(0.8 - lost, abs=1e-8)
