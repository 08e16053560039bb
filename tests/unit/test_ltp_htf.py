"""Theoretical HTFs against a closed form, brute-force simulation, and the properties that every real system has."""

import numpy as np
import pytest
from piecewise_lti import hybrid_spring_mass_damper

from rhythmid.errors import InputError
from rhythmid.ltp.harmonic_state_space import harmonic_state_space
from rhythmid.ltp.htf import linearised, theoretical_htf, transport_delays
from rhythmid.ltp.limit_cycle import limit_cycle
from rhythmid.ltp.linearisation import linearise
from rhythmid.ltp.pumping import Pumping
from rhythmid.model import Model
from rhythmid.simulation.signal import spline
from rhythmid.simulation.simulate import simulate

PUMPING = Pumping.cosine(1.0, 1.0)
SIDEBANDS = np.arange(-2, 3)


@pytest.fixture(scope="module")
def paper(rig):
    return linearised(rig.hopper, PUMPING)


def brute_force(model: Model, frequency: float, amplitude: float = 1e-5) -> np.ndarray:
    """Components at ω + mω_p of the response to a small sinusoid at ω, m = −2 … 2, by two long simulations."""
    settling, window = 30, 10
    dense = np.arange(-10, (settling + window) * 1000 + 10) * 1e-3
    forcing = spline(dense, PUMPING(dense))
    command = spline(dense, amplitude * np.cos(2 * np.pi * frequency * dense))
    stamps = np.arange((settling + window) * 1000) * 1e-3
    start = limit_cycle(model, PUMPING).states[0]
    difference = (
        simulate(model, stamps, command, forcing, start).output
        - simulate(model, stamps, None, forcing, start).output
    )[settling * 1000 :]
    time = stamps[settling * 1000 :]
    return np.array(
        [
            2 * np.mean(difference * np.exp(-2j * np.pi * (frequency + m) * time)) / amplitude
            for m in SIDEBANDS
        ]
    )


def predicted(model: Model, frequency: float, order: int = 20) -> np.ndarray:
    found = linearised(model, PUMPING, order=order)
    return np.array([found.htf(np.array([m]), np.array([frequency + m]))[0, 0] for m in SIDEBANDS])


@pytest.mark.parametrize("frequency", [0.4, 1.3, 2.2, 3.3, 5.7])
def test_the_papers_plant_answers_single_sinusoids_as_predicted(rig, frequency: float) -> None:
    measured = brute_force(rig.hopper, frequency)
    assert np.abs(predicted(rig.hopper, frequency) - measured).max() < 3e-4 * np.abs(measured).max()


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("actuator_lag", {"time_constant": 0.02}),
        ("sensor_lag", {"time_constant": 0.02}),
        ("cubic_stiffness", {"coefficient": 4e5}),
        ("coulomb_friction", {"force": 0.02, "transition": 2e-3}),
    ],
)
def test_models_with_other_elements_and_their_states_do_too(rig, catalogue, name: str, values: dict) -> None:
    model = rig.hopper.with_element(catalogue[name], values)
    measured = brute_force(model, 1.3)
    assert np.abs(predicted(model, 1.3) - measured).max() < 5e-4 * np.abs(measured).max()


def test_the_harmonic_state_space_converges_to_the_closed_form(rig) -> None:
    linear = linearise(limit_cycle(rig.hopper, PUMPING))
    off, on = linear.switches
    exact = hybrid_spring_mass_damper(200.0, 2.0, 1.0, (on, off), 1.0)
    m, frequency = np.arange(-1, 2), np.linspace(0.1, 6.3, 23)
    truth = exact.htf(m, frequency)
    errors = [
        np.abs(harmonic_state_space(linear, order).htf(m, frequency) - truth).max() / np.abs(truth).max()
        for order in (3, 6, 12, 24)
    ]
    assert errors[2] < 5e-5
    assert errors[3] < 1e-5
    assert errors == sorted(errors, reverse=True)


def test_the_closed_form_of_a_machine_that_does_not_switch_is_its_transfer_function() -> None:
    plain = hybrid_spring_mass_damper(200.0, 0.0, 2.0, (0.2, 0.6), 1.0)
    frequency = np.linspace(0.13, 5.0, 9)
    found = plain.htf(np.array([-1, 0, 1]), frequency)
    assert found[1] == pytest.approx(1 / (200 - 2 * (2 * np.pi * frequency) ** 2), rel=1e-9)
    assert np.abs(found[[0, 2]]).max() < 1e-12 * np.abs(found[1]).max()


def test_the_papers_sizes(paper) -> None:
    frequency = np.linspace(0.05, 6.0, 2400)
    found = np.abs(paper.htf(np.array([-2, -1, 0, 1, 2]), frequency)).max(axis=1)
    assert found[2] == pytest.approx(0.069, abs=0.0005)
    assert found[1] == pytest.approx(0.0045, abs=0.00005)
    assert found[3] == pytest.approx(0.0028, abs=0.0001)
    assert found[[0, 4]].max() < 4e-4


def test_conjugate_symmetry_of_a_real_system(paper) -> None:
    m, frequency = np.arange(-3, 4), np.linspace(-6.0, 6.0, 101)
    there, mirrored = paper.htf(m, frequency), paper.htf(-m, -frequency)
    assert mirrored == pytest.approx(there.conj(), abs=1e-9)


def test_power_of_the_output_is_the_sum_over_sidebands(rig, paper) -> None:
    """Parseval: the mean square response to a sinusoid is Σ_m |G_m|² / 2 at the frequencies ω + mω_p."""
    nu, amplitude = 1.3, 1e-5
    dense = np.arange(-10, 40_010) * 1e-3
    forcing, command = (
        spline(dense, PUMPING(dense)),
        spline(dense, amplitude * np.cos(2 * np.pi * nu * dense)),
    )
    stamps = np.arange(40_000) * 1e-3
    start = paper.cycle.states[0]
    moved = simulate(rig.hopper, stamps, command, forcing, start).output
    still = simulate(rig.hopper, stamps, None, forcing, start).output
    power = np.mean((moved - still)[30_000:] ** 2) / amplitude**2
    lines = [abs(paper.htf(np.array([m]), np.array([nu + m]))[0, 0]) ** 2 / 2 for m in range(-8, 9)]
    assert power == pytest.approx(sum(lines), rel=1e-3)


def test_a_machine_without_pumping_is_time_invariant(rig) -> None:
    still = Pumping(1.0, np.zeros(2, dtype=complex))
    model = rig.hopper.with_values({"switched_damper.flight": 2.0})
    frequency = np.linspace(0.2, 5.0, 11)
    found = linearised(model, still).htf(np.array([-1, 0, 1]), frequency)
    omega = 2 * np.pi * frequency
    assert found[1] == pytest.approx(1 / (200 - omega**2 + 2j * omega), rel=1e-6)
    assert np.abs(found[[0, 2]]).max() < 1e-9


def test_delays_turn_phases_as_equation_7_says_and_leave_magnitudes(rig) -> None:
    model = rig.hopper.with_values({"input_delay.delay": 0.04, "measurement_delay.delay": 0.05})
    assert transport_delays(model) == pytest.approx((0.04, 0.05))
    m, frequency = np.array([-1, 0, 1]), np.linspace(0.1, 6.0, 50)
    delayed = theoretical_htf(model, PUMPING, m, frequency)
    plain = theoretical_htf(model, PUMPING, m, frequency, delays=False)
    assert np.abs(delayed.value) == pytest.approx(np.abs(plain.value))  # (8)
    turn = 2 * np.pi * ((frequency - 1 * 1.0) * 0.04 + frequency * 0.05)
    assert delayed.of(1) == pytest.approx(plain.of(1) * np.exp(-1j * turn))  # (7), m = 1


def test_the_simulated_delayed_machine_shows_equation_7(rig) -> None:
    delays = {"input_delay.delay": 0.04, "measurement_delay.delay": 0.05}
    slow = brute_force_delayed(rig.hopper.with_values(delays), 1.3)
    phase = 2 * np.pi * (1.3 * 0.04 + (1.3 + SIDEBANDS) * 0.05)
    assert np.abs(slow - brute_force(rig.hopper, 1.3) * np.exp(-1j * phase)).max() < 1e-3 * np.abs(slow).max()


def brute_force_delayed(model: Model, frequency: float) -> np.ndarray:
    """As `brute_force`, with the transport delays; the simulation then begins before the command does."""
    stamps = np.arange(40_000) * 1e-3
    dense = np.arange(-200, 40_200) * 1e-3
    forcing = spline(dense, PUMPING(dense))
    command = spline(dense, 1e-5 * np.cos(2 * np.pi * frequency * dense))
    start = limit_cycle(model, PUMPING).path((-transport_delays(model)[1]) % 1.0)
    moved = simulate(model, stamps, command, forcing, start).output
    still = simulate(model, stamps, None, forcing, start).output
    time, difference = stamps[30_000:], (moved - still)[30_000:]
    return np.array(
        [2 * np.mean(difference * np.exp(-2j * np.pi * (frequency + m) * time)) / 1e-5 for m in SIDEBANDS]
    )


def test_a_harmonic_that_is_not_there_is_named(rig) -> None:
    found = theoretical_htf(rig.hopper, PUMPING, np.array([0]), np.array([1.3]))
    with pytest.raises(InputError, match="harmonic 3"):
        found.of(3)


def test_a_moving_base_is_refused(rig) -> None:
    with pytest.raises(InputError, match="force or a base acceleration"):
        linearised(rig.hopper, PUMPING, excited="base_displacement")
