"""Elements with states of their own, under prescribed motion and against independent solutions."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid
from scipy.linalg import expm

HEAVY = 1e9  # a mass whose motion nothing changes


def prescribed(rig, name, values, amplitude, frequency, duration):
    """States of an element at x = amplitude sin(2 pi frequency t)."""
    omega = 2 * math.pi * frequency
    model = rig.model(name, values, mass=HEAVY, spring=HEAVY * omega**2)
    run = rig.run(
        model, duration, (0.0, amplitude * omega), period=1e-3 / frequency, max_step=2.5e-4 / frequency
    )
    return run.time, run.position, run.states[:, 2]


def plain_loop(x, yielding):
    """dz/dx of the hysteresis, integrated along the positions with fine explicit steps."""
    z = np.zeros(len(x))
    for k in range(1, len(x)):
        steps = 50
        dx = (x[k] - x[k - 1]) / steps
        value = z[k - 1]
        for _ in range(steps):
            value += dx * (1 - (value / yielding) ** 2 if value * dx > 0 else 1.0)
        z[k] = value
    return z


def test_hysteresis_follows_its_loop_and_starts_on_the_virgin_curve(rig):
    values = {"stiffness": 50.0, "yield_displacement": 4e-3}
    t, x, z = prescribed(rig, "elastoplastic_hysteresis", values, 0.01, 1.0, 2.0)
    rising = t < 0.25
    assert z[rising] == pytest.approx(np.tanh(x[rising] / 4e-3), abs=1e-5)
    assert 4e-3 * z == pytest.approx(plain_loop(x, 4e-3), abs=3e-5)
    assert np.abs(z).max() < 1.0


def test_the_hysteresis_loop_does_not_depend_on_speed(rig):
    values = {"stiffness": 50.0, "yield_displacement": 4e-3}
    slow = prescribed(rig, "elastoplastic_hysteresis", values, 0.01, 0.2, 10.0)[2]
    fast = prescribed(rig, "elastoplastic_hysteresis", values, 0.01, 2.0, 1.0)[2]
    assert slow == pytest.approx(fast, abs=1e-5)


def test_hysteresis_takes_the_energy_of_its_loop(rig, catalogue):
    stiffness, yielding = 50.0, 4e-3
    model = rig.model(
        "elastoplastic_hysteresis", {"stiffness": stiffness, "yield_displacement": yielding}, spring=100.0
    )
    run = rig.run(model, 1.5, (0.05, 0.0))
    energy = 0.5 * run.velocity**2 + 50.0 * run.position**2
    power = stiffness * yielding * run.states[:, 2] * run.velocity
    assert energy[0] - energy[-1] == pytest.approx(trapezoid(power, run.time), rel=1e-4)
    assert energy[-1] < 0.5 * energy[0]


def test_a_vanishing_yield_displacement_becomes_coulomb_friction(rig):
    run = {
        name: rig.run(rig.model(name, values, spring=100.0), 1.0, (0.1, 0.0), max_step=1e-3).position
        for name, values in {
            "elastoplastic_hysteresis": {"stiffness": 0.5 / 1e-6, "yield_displacement": 1e-6},
            "coulomb_friction": {"force": 0.5, "transition": 1e-6},
        }.items()
    }
    assert run["elastoplastic_hysteresis"] == pytest.approx(run["coulomb_friction"], abs=1e-3)


def test_a_hysteresis_yields_within_the_travel(catalogue, scales):
    element = catalogue["elastoplastic_hysteresis"].within(scales)
    half = 0.5 * (
        scales.high - scales.low
    )  # from sliding one way to sliding the other it takes two yield displacements
    assert element.parameter("yield_displacement").bounds == (0.0, half)
    assert element.starts(scales)
    assert all(start["yield_displacement"] <= half for start in element.starts(scales))


def test_relaxation_has_the_complex_stiffness_of_a_maxwell_branch(rig):
    tau, frequency, amplitude = 0.08, 1.5, 0.01
    values = {"stiffness": 30.0, "time_constant": tau}
    t, x, relaxed = prescribed(rig, "viscoelastic_relaxation", values, amplitude, frequency, 4.0)
    omega = 2 * math.pi * frequency
    stretch = 1j * omega * tau / (1 + 1j * omega * tau)
    expected = np.imag(amplitude * stretch * np.exp(1j * omega * t))
    late = t > 2.0
    assert (x - relaxed)[late] == pytest.approx(expected[late], abs=1e-8)


def test_relaxation_shorter_than_a_step_is_a_viscous_damper(rig):
    stiffness, tau = 4e4, 5e-5
    fast = rig.run(
        rig.model("viscoelastic_relaxation", {"stiffness": stiffness, "time_constant": tau}, spring=100.0),
        1.0, (0.05, 0.0), max_step=1e-3,
    )  # fmt: skip
    viscous = rig.run(
        rig.model("viscous_damper", {"damping": stiffness * tau}, spring=100.0), 1.0, (0.05, 0.0)
    )
    assert fast.position == pytest.approx(viscous.position, abs=1e-3)
    assert np.abs(viscous.position[-100:]).max() < 0.02  # well damped


def test_second_mode_moves_as_two_coupled_masses(rig):
    mass, frequency, ratio, first, spring = 0.3, 3.0, 0.07, 1.2, 150.0
    model = rig.model(
        "second_mode",
        {"mass": mass, "frequency": frequency, "damping_ratio": ratio},
        mass=first,
        spring=spring,
    )
    run = rig.run(model, 2.0, (0.05, -0.3))
    omega = 2 * math.pi * frequency
    stiffness, damping = mass * omega**2, 2 * ratio * mass * omega
    matrix = np.array(
        [
            [0, 1, 0, 0],
            [-(spring + stiffness) / first, -damping / first, stiffness / first, damping / first],
            [0, 0, 0, 1],
            [stiffness / mass, damping / mass, -stiffness / mass, -damping / mass],
        ]
    )
    step, state = expm(matrix * 1e-3), np.array([0.05, -0.3, 0.05, -0.3])
    expected = []
    for _ in run.time:
        expected.append(state[0])
        state = step @ state
    assert run.position == pytest.approx(np.array(expected), abs=1e-8)


def test_a_mode_too_fast_for_the_step_is_an_added_mass(rig):
    model = rig.model("second_mode", {"mass": 0.5, "frequency": 1e6, "damping_ratio": 0.5}, spring=100.0)
    run = rig.run(model, 1.0, (0.1, 0.0), max_step=1e-3)
    assert run.position == pytest.approx(0.1 * np.cos(math.sqrt(100.0 / 1.5) * run.time), abs=2e-4)


def test_backlash_in_a_sprung_machine_agrees_with_a_plain_integration(rig):
    model = rig.model("backlash", {"width": 0.4}, spring=100.0)
    drive = 2 * math.pi * 1.1
    run = rig.run(model, 2.0, command=lambda t: np.sin(drive * t))
    played, expected = 0.0, []
    for f in np.sin(drive * run.time):  # the exact play operator, sample by sample
        played = max(f - 0.2, min(f + 0.2, played))
        expected.append(played)
    position = solve_ivp(
        lambda t, s: [s[1], expected[min(int(t / 1e-3 + 1e-9), len(expected) - 1)] - 100.0 * s[0]],
        (0, 2.0), [0.0, 0.0], t_eval=run.time, max_step=1e-3, rtol=1e-8, atol=1e-10,
    ).y[0]  # fmt: skip
    assert run.position == pytest.approx(position, abs=5e-3 * np.abs(position).max())
