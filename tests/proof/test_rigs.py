"""The machines of the proof against closed forms, conserved energy, and scipy on the same equations written plainly."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.model import Model
from rhythmid.proof.machine import UNFORCED, Effect, Machine, observe
from rhythmid.proof.machines.designs import DESIGNS
from rhythmid.proof.machines.rig import Rig
from rhythmid.proof.nominal import nominal_model
from rhythmid.proof.sizes import SIZES, motion_of
from rhythmid.proof.sizing import force_share, mismatch, with_shift

SHOWN = 0.5  # [s] of a record that is compared
MACHINE = Machine(1.0, 0.0, 2.0, 0.0, 0.0, return_damping=2.0)


def _rig(name: str, conceals: tuple[str, ...] = (), seed: int = 1) -> Rig:
    return DESIGNS[name].draw(np.random.default_rng(seed), conceals)


def _plain(rig: Rig, run, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """States (n, 2) and efforts (n,) of a machine without effects, from one sample to the next by scipy."""
    m, time, command = rig.machine, run.time, run.command
    z, summed, level = np.array(run.start), 0.0, 0.0
    states, efforts = [], []
    for k in range(steps):
        states.append(z)
        miss = command[k] - (z[1] if m.mode == "sampled_velocity" else z[0])
        summed += miss / run.rate if k else 0.0
        level = m.proportional * miss + m.integral * summed - m.derivative * z[1]
        efforts.append(level)

        def rates(t, z):
            base, moved = 0.0, 0.0
            if m.mode == "base":
                numbers = run.numbers
                waves = [
                    (a, 2 * math.pi * f, p)
                    for a, f, p in zip(numbers["sizes"], numbers["frequencies"], numbers["phases"])
                ]
                base = sum(a * math.sin(w * t + p) for a, w, p in waves)
                moved = sum(a * w * math.cos(w * t + p) for a, w, p in waves)
            force = {
                "force": command[k],  # noqa: B023
                "base": 0.0,
                "continuous": m.proportional * (command[k] - z[0]) - m.derivative * z[1],  # noqa: B023
            }.get(m.mode, level)  # noqa: B023
            leg = -m.stiffness * (z[0] - base - m.rest_length) - m.damping * (z[1] - moved)
            return [z[1], (force + leg - m.moment * math.sin(z[0])) / m.mass]

        z = solve_ivp(rates, (time[k], time[k + 1]), z, rtol=1e-9, atol=1e-12).y[:, -1]
    return np.array(states), np.array(efforts)


@pytest.mark.parametrize("name", [name for name in DESIGNS if name != "hopper"])
@pytest.mark.parametrize("seed", [1, 2])
def test_every_machine_agrees_with_scipy_on_its_equations_written_plainly(name, seed):
    rig = replace(_rig(name, seed=seed), input_delay=0.0)
    run = next((run for run in rig.runs if run.shape == "tones"), rig.runs[0])
    steps = round(SHOWN * run.rate)
    states, efforts = _plain(rig, run, steps)
    seen = rig.observe([], run)
    assert seen is not None
    size = np.abs(states).max(axis=0)
    np.testing.assert_allclose(seen.position[:steps], states[:, 0], atol=2e-6 * size[0])
    np.testing.assert_allclose(seen.velocity[:steps], states[:, 1], atol=2e-6 * size[1])
    if rig.recorded == "effort":
        np.testing.assert_allclose(seen.effort[:steps], efforts, atol=1e-5 * np.abs(efforts).max())
    measured = seen.velocity if rig.velocity else seen.position
    np.testing.assert_array_equal(seen.measured, measured)


def test_a_pendulum_without_damping_keeps_its_energy_at_large_swings():
    free = Machine(0.1, 0.0, 0.0, 0.0, 0.0, moment=2.0)
    time = np.arange(2000) / 100.0
    seen = observe(free, [], UNFORCED, time, np.zeros(len(time)), start=(2.5, 0.0))
    assert seen is not None
    energy = 0.05 * seen.velocity**2 - 2.0 * np.cos(seen.position)
    np.testing.assert_allclose(energy, energy[0], atol=1e-6)


def test_a_free_decay_follows_its_closed_form():
    mass, k, c, rest = 1.5, 90.0, 0.8, 0.02
    time = np.arange(1000) / 100.0
    machine = Machine(mass, k, c, rest, 0.0, return_damping=c)
    seen = observe(machine, [], UNFORCED, time, np.zeros(len(time)), start=(0.07, 0.0))
    assert seen is not None
    a = c / (2 * mass)
    w = math.sqrt(k / mass - a * a)
    expected = rest + 0.05 * np.exp(-a * time) * (np.cos(w * time) + a / w * np.sin(w * time))
    np.testing.assert_allclose(seen.position, expected, atol=1e-9)


def test_a_mass_on_a_shaken_base_moves_as_its_transmissibility_says():
    mass, k, c, w = 0.5, 500.0, 3.0, 2 * math.pi * 4.0
    time = np.arange(3000) / 500.0
    machine = Machine(mass, k, c, 0.0, 0.0, return_damping=c, mode="base")
    base, slopes = 1e-3 * np.sin(w * time), 1e-3 * w * np.cos(w * time)
    seen = observe(machine, [], UNFORCED, time, base, slopes=slopes, start=(0.0, 0.0))
    assert seen is not None
    ratio = (k + 1j * w * c) / (k - mass * w * w + 1j * w * c)
    expected = np.imag(1e-3 * ratio * np.exp(1j * w * time))
    np.testing.assert_allclose(seen.position[2000:], expected[2000:], atol=5e-8)


def test_a_servo_answers_a_late_step_of_its_reference_like_a_second_order_loop():
    omega, ratio, late = 15.0, 0.6, 0.0123
    machine = Machine(
        1.0, 0.0, 0.0, 0.0, 0.0, proportional=omega**2, derivative=2 * ratio * omega, mode="continuous"
    )
    time = np.arange(100) / 100.0
    seen = observe(machine, [], UNFORCED, time, np.ones(100), input_delay=late, start=(0.0, 0.0))
    assert seen is not None
    t, w = np.maximum(time - late, 0.0), omega * math.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * omega * t) * (np.cos(w * t) + ratio * omega / w * np.sin(w * t))
    np.testing.assert_allclose(seen.position, 1.0 - decay, atol=1e-9)


def test_a_set_point_ramp_makes_the_reference_follow_at_its_rate():
    machine = Machine(1.0, 0.0, 0.0, 0.0, 0.0, proportional=1e4, derivative=200.0, mode="continuous")
    time = np.arange(300) / 100.0
    ramp = Effect("reference_rate_limit", {"rate": 0.5})
    seen = observe(machine, [ramp], UNFORCED, time, np.ones(300), start=(0.0, 0.0))
    assert seen is not None
    np.testing.assert_allclose(seen.velocity[20:190], 0.5, atol=1e-6)
    assert seen.position[-1] == pytest.approx(1.0, abs=1e-6)


def test_a_velocity_controller_brings_the_mass_to_its_reference_speed():
    machine = replace(MACHINE, proportional=20.0, integral=50.0, mode="sampled_velocity")
    time = np.arange(3000) / 500.0
    seen = observe(machine, [], UNFORCED, time, np.full(3000, 0.3), start=(0.0, 0.0))
    assert seen is not None
    assert seen.velocity[-1] == pytest.approx(0.3, abs=1e-6)
    assert seen.effort[-1] == pytest.approx(2.0 * 0.3, abs=1e-5)


def test_friction_of_a_leg_sees_the_motion_relative_to_its_base():
    machine = Machine(1.0, 0.0, 0.0, 0.0, 0.0, mode="base")
    time = np.arange(500) / 500.0
    seen = observe(
        machine, [Effect("coulomb_friction", {"force": 0.2})], UNFORCED, time, time, slopes=np.ones(500),
        start=(0.0, 0.0),
    )  # fmt: skip
    assert seen is not None  # a base that runs away at 1 m/s drags the mass along at F / m
    np.testing.assert_allclose(seen.velocity, 0.2 * time, atol=1e-6)


def test_the_force_that_effects_add_is_the_truth_less_the_plain_machine():
    drag = Effect("three_halves_drag", {"coefficient": 0.7})
    time = np.arange(400) / 200.0
    seen = observe(MACHINE, [drag], UNFORCED, time, np.sin(4 * time), start=(0.0, 0.0))
    assert seen is not None
    speed = seen.velocity
    np.testing.assert_allclose(seen.added, -0.7 * speed * np.sqrt(np.abs(speed)), atol=1e-12)


def test_friction_that_relaxes_settles_where_ageing_and_sliding_balance():
    force, distance, ageing, speed = 0.3, 0.1, 0.5, 0.4
    machine = replace(MACHINE, proportional=200.0, integral=400.0, mode="sampled_velocity")
    time = np.arange(4000) / 500.0
    rub = Effect("relaxing_friction", {"force": force, "distance": distance, "ageing": ageing})
    seen = observe(machine, [rub], UNFORCED, time, np.full(4000, speed), start=(0.0, 0.0))
    assert seen is not None
    level = 1.0 / (1.0 + ageing * speed / distance)
    assert seen.added[-1] == pytest.approx(-force * (0.5 + level), rel=1e-4)


def test_the_out_of_catalogue_forces_on_position_are_periodic_and_narrow():
    rig = _rig("joint")
    plain = rig.observe_all([])
    assert plain is not None
    motion = motion_of(rig.machine, rig.forcing, rig.runs, plain)
    cogging = SIZES["two_harmonic_cogging"](np.random.default_rng(0), motion)(0.5)
    seen = rig.observe([Effect("two_harmonic_cogging", cogging)], rig.runs[0])
    assert seen is not None
    turn = 2 * math.pi * seen.position / cogging["wavelength"]
    expected = np.sin(turn + cogging["phase"]) + cogging["second"] * np.sin(
        2 * turn + cogging["second_phase"]
    )
    np.testing.assert_allclose(seen.added, cogging["amplitude"] * expected, atol=1e-9 * cogging["amplitude"])
    magnet = SIZES["magnet"](np.random.default_rng(0), motion)(0.5)
    pulled = rig.observe([Effect("magnet", magnet)], rig.runs[0])
    assert pulled is not None
    assert np.abs(pulled.added).max() <= magnet["force"] * (1 + 1e-9)
    far = np.abs(pulled.position - magnet["place"]) > 6 * magnet["width"]
    assert np.abs(pulled.added[far]).max(initial=0.0) < 1e-5 * magnet["force"]


def test_a_mismatch_in_the_effort_leaves_out_what_free_parameters_absorb():
    rig = _rig("axis")
    more = 0.3 * rig.machine.damping
    damped = rig.observe_all([Effect("viscous_damper", {"damping": more})])
    assert force_share(rig, damped, ("mass", "damping")) < 1e-9
    assert force_share(rig, damped, ("mass",)) > 1e-3
    rubbed = rig.observe_all([Effect("coulomb_friction", {"force": 0.1})])
    plain = rig.observe_all([])
    assert force_share(rig, rubbed, ("mass", "damping")) > 1e-4 > force_share(rig, plain, ("mass", "damping"))


@pytest.mark.parametrize("name", ["shaken", "motor"])
def test_a_lag_of_half_a_sample_is_a_shift_of_the_input_and_no_mismatch(name):
    catalogue, rig = load_catalogue(), _rig(name)
    text = nominal_model(rig, DESIGNS[name], rig.machine)
    exact = with_shift(Model.from_text(text, catalogue=catalogue), rig, catalogue)
    lag, element = (
        {"shaken": "sensor_lag", "motor": "actuator_lag"}[name],
        {"time_constant": 0.5 / rig.runs[0].rate},
    )
    lagged, plain = rig.observe_all([Effect(lag, element)]), rig.observe_all([])
    assert plain is not None
    size = float(np.std(np.concatenate([one.measured for one in plain])))
    fixed = Model.from_text(text, catalogue=catalogue)
    assert mismatch(exact, rig, lagged, 1e-3 * size) < 0.2 * mismatch(fixed, rig, lagged, 1e-3 * size)
