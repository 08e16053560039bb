"""Stiffness laws against the exact periods of their free swings and against conserved energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from rhythmid.model import Model


def closes_after(rig, model, amplitude, period):
    """Whether a free swing from rest is back at its start after one period, and not before."""
    run = rig.run(model, period, (amplitude, 0.0), period=period / 1000)
    half = len(run.time) // 2
    return run.position[-1] == pytest.approx(amplitude, rel=1e-5) and run.position[half] < 0.9 * amplitude


@pytest.mark.parametrize("coefficient", [4e4, -5e3])
def test_cubic_stiffness_swings_with_duffings_exact_period(rig, coefficient):
    model = rig.model("cubic_stiffness", {"coefficient": coefficient}, spring=200.0, mass=2.0)
    linear, cubic, amplitude = 200.0 / 2.0, coefficient / 2.0, 0.08
    peak = linear + cubic * amplitude**2
    period = 4 * ellipk(cubic * amplitude**2 / (2 * peak)) / math.sqrt(peak)
    assert closes_after(rig, model, amplitude, period)
    assert not closes_after(rig, model, amplitude, 2 * math.pi / math.sqrt(linear))


@pytest.mark.parametrize(
    ("name", "coefficient", "power"), [("quadratic_stiffness", 300.0, 2), ("quintic_stiffness", 2e6, 5)]
)
def test_polynomial_stiffness_keeps_the_energy_of_its_potential(rig, name, coefficient, power):
    model = rig.model(name, {"coefficient": coefficient}, spring=100.0, rest=0.3, mass=2.0)
    run = rig.run(model, 1.5, (0.4, 0.0))
    e = run.position - 0.3
    energy = run.velocity**2 + 50.0 * e**2 + coefficient * e ** (power + 1) / (power + 1)
    assert energy == pytest.approx(energy[0], rel=1e-8)
    assert coefficient * e[0] ** (power + 1) / (power + 1) > 0.1 * energy[0]


def test_bilinear_stiffness_swings_half_a_period_on_each_side(rig):
    model = rig.model("bilinear_stiffness", {"change": 60.0, "kink": 0.0}, spring=100.0)
    period = math.pi / math.sqrt(160.0) + math.pi / math.sqrt(100.0)
    assert closes_after(rig, model, 0.1, period)


def test_freeplay_adds_the_time_that_it_takes_to_cross_the_gap(rig):
    gap, amplitude, stiffness = 0.04, 0.1, 100.0
    model = rig.model("freeplay", {"gap": gap}, spring=stiffness)
    omega = math.sqrt(stiffness)
    crossing = omega * (amplitude - gap / 2)
    assert closes_after(rig, model, amplitude, 2 * math.pi / omega + 2 * gap / crossing)


def test_position_ripple_is_a_pendulum_in_its_phase(rig):
    force, wavelength, mass = 3.0, 0.05, 2.0
    model = rig.model(
        "position_ripple", {"amplitude": force, "wavelength": wavelength, "phase": math.pi}, mass=mass
    )
    amplitude = 0.3 * wavelength
    omega = math.sqrt(2 * math.pi * force / (wavelength * mass))
    swing = 2 * math.pi * amplitude / wavelength
    assert closes_after(rig, model, amplitude, 4 * ellipk(math.sin(swing / 2) ** 2) / omega)


def test_pendulum_gravity_swings_with_the_exact_period_at_large_angles(rig):
    model = rig.model("pendulum_gravity", {"moment": 12.0, "reference": 0.5}, mass=2.0)
    omega = math.sqrt(12.0 / 2.0)
    run = rig.run(model, 4 * ellipk(math.sin(1.2 / 2) ** 2) / omega, (0.5 + 1.2, 0.0), period=1e-3)
    assert run.position.min() == pytest.approx(0.5 - 1.2, rel=1e-5)
    assert run.position[-1] == pytest.approx(0.5 + 1.2, abs=2e-5)


def test_pendulum_gravity_is_written_in_the_units_of_a_rotational_machine(catalogue):
    model = Model.from_text(
        """
inertia: {mass: {value: 0.02, unit: kg*m^2}}
force: [{pendulum_gravity: {moment: {value: 0.5, unit: N*m}, reference: {value: 0.1, unit: rad}}}]
""",
        catalogue=catalogue,
    )
    units = {name: value.unit for name, value in model.parameters.items()}
    assert units["pendulum_gravity.moment"] == "N*m" and units["pendulum_gravity.reference"] == "rad"


def test_stiffness_elements_follow_the_rest_length_of_the_spring(rig):
    run = {}
    for rest in (0.0, 0.7):
        model = rig.model("cubic_stiffness", {"coefficient": 4e4}, spring=200.0, rest=rest)
        run[rest] = rig.run(model, 0.5, (rest + 0.05, 0.0)).position - rest
    assert run[0.7] == pytest.approx(run[0.0], abs=1e-12)
    assert np.ptp(run[0.0]) > 0.09


def test_gravity_is_sought_hanging_any_way_wherever_the_motion_is(catalogue, scales):
    starts = catalogue["pendulum_gravity"].starts
    around = replace(scales, low=-20.0, high=1.0, centre=-8.0)
    found = {start["reference"] for start in starts(around)}
    assert len(found) == 4 and max(found) - min(found) == pytest.approx(1.5 * math.pi)
    swinging = replace(scales, low=scales.centre - 0.3, high=scales.centre + 0.3)
    found = [start["reference"] for start in starts(swinging)]
    assert len(found) == 4 and found[0] == scales.centre  # an arm's link may hang outside of its travel
