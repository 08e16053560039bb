"""Contacts against ballistic flight, conserved energy and the closed form of the coefficient of restitution."""

import math

import numpy as np
import pytest

GRAVITY = 9.81


def test_without_ground_contact_the_mass_flies_freely_and_lands_again(rig):
    model = rig.model("ground_contact_loss", {"loss": 1.0}, spring=400.0, rest=0.2, gravity=GRAVITY)
    run = rig.run(model, 0.6, (0.2, 1.0))
    flight = run.time < 2 * 1.0 / GRAVITY
    parabola = 0.2 + run.time - 0.5 * GRAVITY * run.time**2
    assert run.position[flight] == pytest.approx(parabola[flight], abs=1e-4)
    leg = np.minimum(run.position - 0.2, 0.0)
    energy = 0.5 * run.velocity**2 + GRAVITY * run.position + 200.0 * leg**2
    assert energy == pytest.approx(energy[0], rel=1e-3)
    assert run.position.min() < 0.2 - 0.05


def test_a_damped_leg_has_no_force_in_the_air(rig):
    model = rig.model(
        "ground_contact_loss", {"loss": 1.0}, spring=400.0, rest=0.2, gravity=GRAVITY, stance=5.0, flight=5.0
    )
    run = rig.run(model, 0.15, (0.2, 1.0))
    assert run.velocity == pytest.approx(1.0 - GRAVITY * run.time, abs=2e-3)


def test_a_partial_loss_leaves_the_rest_of_the_leg_force(rig):
    model = rig.model("ground_contact_loss", {"loss": 0.75}, spring=400.0)
    run = rig.run(model, 0.4, (0.1, 0.0))
    quarter_up, half_down = (
        math.pi / 2 / 10.0,
        math.pi / 20.0,
    )  # a quarter of the spring above, all of it below
    bottom = run.time[np.argmin(run.position)]
    assert bottom == pytest.approx(quarter_up + half_down / 2, abs=1e-3)
    assert run.position.min() == pytest.approx(-0.05, rel=1e-3)  # half the amplitude at twice the frequency


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.4])
def test_an_end_stop_returns_the_speed_that_its_restitution_says(rig, side, ratio):
    values = {"stiffness": 2e4, "damping_ratio": ratio, "position": side * 0.1, "side": side}
    run = rig.run(rig.model("end_stop_contact", values, mass=2.0), 0.5, (0.0, side * 0.5))
    # contact ends when the force, not the penetration, is zero (T. Schwager, T. Poschel, Granular Matter 9, 2007)
    root = math.sqrt(1 - ratio**2)
    angle = math.pi - math.atan2(2 * ratio * root, 1 - 2 * ratio**2)
    assert run.velocity[-1] == pytest.approx(-side * 0.5 * math.exp(-ratio / root * angle), rel=2e-3)
    assert np.all(side * run.position < 0.1 + 0.5 / math.sqrt(2e4 / 2.0) * 1.01)


def test_an_end_stop_is_not_felt_short_of_it(rig):
    values = {"stiffness": 2e4, "damping_ratio": 0.4, "position": 0.1, "side": 1.0}
    run = rig.run(rig.model("end_stop_contact", values, spring=100.0), 1.0, (0.099, 0.0))
    assert run.position == pytest.approx(0.099 * np.cos(10.0 * run.time), abs=1e-8)
