"""Friction against closed forms and energy balances."""

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid


def turning_points(x):
    """Local extremes of a sampled motion."""
    slope = np.diff(x)
    return x[1:-1][slope[:-1] * slope[1:] < 0]


def test_coulomb_friction_shrinks_a_free_swing_by_equal_steps(rig):
    model = rig.model("coulomb_friction", {"force": 0.5, "transition": 1e-5}, spring=100.0)
    x = rig.run(model, 1.8, (0.1, 0.0)).position
    steps = -np.diff(np.abs(np.concatenate([[0.1], turning_points(x)])))
    assert steps == pytest.approx(2 * 0.5 / 100.0, rel=0.01)  # 2 F_c / k every half swing


def test_a_mass_held_by_friction_rests_without_chatter_at_a_coarse_step(rig):
    model = rig.model("coulomb_friction", {"force": 4.0, "transition": 1e-6}, spring=100.0)
    run = rig.run(model, 1.0, (0.1, 0.0), max_step=1e-3)
    resting = run.velocity[-300:]
    assert abs(100.0 * run.position[-1]) < 4.0
    assert np.all(resting * resting[0] >= 0) and np.abs(np.diff(resting)).max() < 1e-5


def test_asymmetric_friction_takes_more_in_one_direction(rig):
    values = {"force": 0.5, "asymmetry": 0.4, "transition": 1e-5}
    x = rig.run(rig.model("asymmetric_coulomb_friction", values, spring=100.0), 0.9, (0.1, 0.0)).position
    down, up = turning_points(x)[:2]
    assert 0.1 + down == pytest.approx(2 * 0.5 * (1 - 0.4) / 100.0, rel=0.02)  # v < 0 on the way down
    assert -down - up == pytest.approx(2 * 0.5 * (1 + 0.4) / 100.0, rel=0.02)


def test_asymmetric_friction_is_coulomb_friction_and_a_constant_force_while_sliding(catalogue):
    asymmetric = catalogue["asymmetric_coulomb_friction"].kernel
    symmetric = catalogue["coulomb_friction"].kernel
    for v in (-0.3, 0.2):
        both = asymmetric(0.0, v, 0.0, 0.0, 0.5, 0.4, 1e-4, 1.0, 1e-3)
        assert both == pytest.approx(symmetric(0.0, v, 0.0, 0.0, 0.5, 1e-4, 1.0, 1e-3) - 0.5 * 0.4)


@pytest.mark.parametrize(
    ("name", "values", "level"),
    [
        ("coulomb_friction", {"force": 0.3, "transition": 0.02}, lambda v: 0.3),
        (
            "stribeck_friction",
            {"force": 0.2, "static_ratio": 2.5, "stribeck_speed": 0.1, "transition": 0.02},
            lambda v: 0.2 + 0.3 * np.exp(-((v / 0.1) ** 2)),
        ),
    ],
)
def test_friction_takes_the_energy_that_its_law_says(rig, name, values, level):
    run = rig.run(rig.model(name, values, spring=100.0), 1.2, (0.1, 0.0))
    energy = 0.5 * run.velocity**2 + 50.0 * run.position**2
    power = level(run.velocity) * np.tanh(run.velocity / 0.02) * run.velocity
    assert energy[0] - energy[-1] == pytest.approx(trapezoid(power, run.time), rel=1e-4)
    assert energy[-1] < 0.75 * energy[0]


def test_stribeck_friction_contains_coulomb_friction(catalogue):
    stribeck, coulomb = catalogue["stribeck_friction"].kernel, catalogue["coulomb_friction"].kernel
    for v in (-0.2, -1e-3, 0.0, 0.05):
        flat = stribeck(0.0, v, 0.0, 0.0, 0.5, 1.0, 0.01, 1e-3, 1.0, 1e-3)
        assert flat == pytest.approx(coulomb(0.0, v, 0.0, 0.0, 0.5, 1e-3, 1.0, 1e-3))


def test_load_dependent_friction_takes_its_share_of_the_force(rig):
    model = rig.model("load_dependent_friction", {"coefficient": 0.2, "transition": 1e-6})
    run = rig.run(model, 1.0, command=lambda t: np.full(len(t), 2.0))
    assert run.position[-1] == pytest.approx(0.5 * 2.0 * (1 - 0.2), rel=1e-3)


LUGRE = {"force": 0.5, "static_ratio": 1.6, "stribeck_speed": 0.05, "presliding": 1e-3, "damping_time": 0.0}


@pytest.mark.parametrize("speed", [0.01, 0.05, -0.2])
def test_lugre_friction_slides_on_the_stribeck_curve(rig, catalogue, speed):
    model = rig.model("lugre_friction", LUGRE, mass=1e9)  # a speed that nothing changes
    bent = rig.run(model, 4.0, (0.0, speed)).states[-1, 2]
    force, rate = catalogue["lugre_friction"].kernel(0.0, speed, 0.0, 0.0, *LUGRE.values(), 2.5e-4, bent)
    expected = 0.5 * (1 + 0.6 * math.exp(-((speed / 0.05) ** 2)))
    assert force == pytest.approx(-math.copysign(expected, speed), rel=1e-6)
    assert rate == pytest.approx(0.0, abs=1e-5)


def test_lugre_bristles_are_a_spring_before_sliding(rig):
    model = rig.model("lugre_friction", LUGRE)
    run = rig.run(model, 1.0, (0.0, 1e-5))
    stiffness = 0.5 / 1e-3  # sigma_0 = F_c / z_c
    omega = math.sqrt(stiffness)
    assert run.position[:200] == pytest.approx(
        1e-5 / omega * np.sin(omega * run.time[:200]), abs=0.02e-5 / omega
    )


@pytest.mark.parametrize("ratio", [0.0, 0.4, 1.0])
def test_the_friction_of_a_transmitted_load_is_its_share_of_what_both_sides_load_the_gear_with(rig, ratio):
    mu, weight, lift = 0.1, 1.0, 3.0
    values = {"coefficient": mu, "external_ratio": ratio, "transition": 1e-6}
    model = rig.model("transmitted_load_friction", values, gravity=weight)
    up = rig.run(model, 1.0, command=lambda t: np.full(len(t), lift))
    down = rig.run(model, 1.0)
    level = mu * (lift + ratio * weight)  # the motor lifts the load: both press the teeth
    assert up.position[-1] == pytest.approx(0.5 * (lift - weight - level), rel=1e-3)
    assert down.position[-1] == pytest.approx(-0.5 * (weight - mu * ratio * weight), rel=1e-3)


def test_a_gear_that_is_driven_by_its_load_and_its_motor_alike_is_relieved(rig):
    values = {"coefficient": 0.2, "external_ratio": 1.0, "transition": 1e-6}
    model = rig.model("transmitted_load_friction", values, gravity=1.0)
    run = rig.run(model, 1.0, command=lambda t: np.full(len(t), -1.0))
    assert run.position[-1] == pytest.approx(-0.5 * 2.0, rel=1e-6)


def test_losses_are_no_load_of_a_gear(rig, catalogue):
    values = {"coefficient": 0.2, "external_ratio": 1.0, "transition": 1e-6}
    plain = rig.model("transmitted_load_friction", values)
    braked = plain.with_element(catalogue["coulomb_friction"], {"force": 0.5, "transition": 1e-6})
    run = rig.run(braked, 1.0, command=lambda t: np.full(len(t), 2.0))
    assert run.position[-1] == pytest.approx(0.5 * (2.0 - 0.5 - 0.2 * 2.0), rel=1e-3)


def test_load_dependent_friction_is_that_of_a_transmitted_load_without_an_external_one(catalogue):
    for f, v in ((2.0, 0.3), (-1.0, 0.1)):
        whole = catalogue["transmitted_load_friction"].kernel(5.0, 0.0, v, 0.0, f, 0.1, 0.0, 0.01, 1.0, 1e-3)
        assert whole == catalogue["load_dependent_friction"].kernel(0.0, v, 0.0, f, 0.1, 0.01, 1.0, 1e-3)


def bent(rig, shape: float, initial: tuple[float, float], duration: float):
    """A mass too heavy to be braked, on Bouc-Wen hysteresis with z_y = 0.1 and k_h = 3; the share z / z_y."""
    values = {"stiffness": 3.0, "yield_displacement": 0.1, "shape": shape}
    return rig.run(rig.model("bouc_wen_hysteresis", values, mass=1e9), duration, initial)


@pytest.mark.parametrize("shape", [0.5, 1.0])
def test_bouc_wen_hysteresis_yields_exponentially_from_rest(rig, shape):
    run = bent(rig, shape, (0.0, 0.5), 0.6)
    assert run.states[:, 2] == pytest.approx(1.0 - np.exp(-run.position / 0.1), abs=1e-6)


@pytest.mark.parametrize("shape", [0.5, 0.8, 1.0])
def test_bouc_wen_hysteresis_unloads_by_its_shape(catalogue, shape):
    kernel = catalogue["bouc_wen_hysteresis"].kernel
    force, rate = kernel(0.0, -2.0, 0.0, 0.0, 3.0, 0.1, shape, 1e-4, 0.6)
    assert force == pytest.approx(-3.0 * 0.1 * 0.6)
    assert rate == pytest.approx(
        -2.0 / 0.1 * (1.0 + (2.0 * shape - 1.0) * 0.6)
    )  # elastic for 1/2, Dahl's for 1


def test_dahl_s_friction_is_lugre_friction_without_bristle_damping_and_stribeck_fall(catalogue):
    dahl, lugre = catalogue["bouc_wen_hysteresis"].kernel, catalogue["lugre_friction"].kernel
    for v, share in ((0.3, 0.4), (-0.3, 0.4), (0.2, -0.9)):
        assert dahl(0.0, v, 0.0, 0.0, 5.0, 0.1, 1.0, 1e-4, share) == pytest.approx(
            lugre(0.0, v, 0.0, 0.0, 0.5, 1.0, 1.0, 0.1, 0.0, 1e-4, share)
        )


def test_bouc_wen_hysteresis_that_yields_at_once_is_coulomb_friction(rig):
    values = {"stiffness": 0.5 / 1e-5, "yield_displacement": 1e-5}
    x = rig.run(rig.model("bouc_wen_hysteresis", values, spring=100.0), 1.8, (0.1, 0.0)).position
    steps = -np.diff(np.abs(np.concatenate([[0.1], turning_points(x)])))
    assert steps == pytest.approx(2 * 0.5 / 100.0, rel=0.01)
