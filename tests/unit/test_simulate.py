"""The simulator against an adaptive reference, closed forms, and itself."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from scipy.integrate import solve_ivp

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.signal import first_order_hold, spline, zero_order_hold
from rhythmid.simulation.simulate import MAX_STEP, simulate

HOPPER = Model.from_text(
    """
inertia: {mass: 1.0}
command: [{input_delay: {delay: 0.0}}]
force:
  - gravity: {acceleration: 9.81}
  - linear_spring: {stiffness: 200.0, rest_length: 0.2}
  - switched_damper: {stance: 2.0, flight: 0.0}
  - periodic_forcing: {amplitude: 1.0, frequency: 1.0}
sensor: [{measurement_delay: {delay: 0.0}}]
"""
)
SMOOTH = HOPPER.without("switched_damper").with_element(load_catalogue()["viscous_damper"], {"damping": 1.0})
TIME = np.arange(1500) * 1e-3
CHIRP = 0.1 * np.sin(7 * np.pi * TIME**2 / 3)  # twenty times the paper's amplitude, ten times its sweep rate
START = (0.15, 0.1)


def reference(model, knots, values, start, until):
    """Position at any time by DOP853 at tight tolerance; each command and each side of the switch is a piece of its own.

    `values[i]` is the command between knots[i] and knots[i + 1]; before the first it is zero.
    """
    mass, k, rest = (
        model.value(n) for n in ("inertia.mass", "linear_spring.stiffness", "linear_spring.rest_length")
    )
    switched = "switched_damper.stance" in model.parameters

    def rates(t, state, command, stance):
        x, v = state
        if switched:
            damping = model.value("switched_damper.stance" if stance else "switched_damper.flight")
        else:
            damping = model.value("viscous_damper.damping")
        return v, (math.cos(2 * math.pi * t) + command - k * (x - rest) - damping * v) / mass - 9.81

    def turns(t, state, command, stance):
        return state[1]

    turns.terminal = True
    pieces = []
    t, state = 0.0, np.array(start, dtype=float)
    inside = (knots > 0.0) & (knots < until)
    for end in [*knots[inside], until]:
        index = np.searchsorted(knots, t, side="right") - 1
        command = values[index] if index >= 0 else 0.0
        while t < end:
            stance = state[1] > 0.0 if state[1] != 0.0 else rates(t, state, command, True)[1] > 0.0
            turns.direction = -1.0 if stance else 1.0
            piece = solve_ivp(
                rates, (t, end), state, "DOP853", dense_output=True, events=turns if switched else None,
                rtol=1e-12, atol=1e-14, args=(command, stance),
            )  # fmt: skip
            pieces.append((piece.t[0], piece.t[-1], piece.sol))
            t, state = piece.t[-1], piece.y[:, -1].copy()
            if piece.status == 1:
                state[1] = 0.0
    begins = np.array([begin for begin, _, _ in pieces])

    def position(at):
        which = np.clip(np.searchsorted(begins, at, side="right") - 1, 0, None)
        return np.array([pieces[i][2](x)[0] for i, x in zip(which, at)])

    return position


@pytest.fixture(scope="module")
def switching_reference():
    """The paper's hopper under a chirp whose commands arrive a fractional 40.3 ms late."""
    return reference(HOPPER, TIME + 0.0403, CHIRP, START, TIME[-1])


@pytest.mark.parametrize(("max_step", "error"), [(2.5e-4, 1e-9), (1e-3, 5e-9)])
def test_the_switching_hopper_with_fractional_delays_follows_the_reference(
    switching_reference, max_step, error
):
    """The motion is some 25 mm; what the switch costs is nanometres."""
    model = HOPPER.with_values({"input_delay.delay": 0.0403, "measurement_delay.delay": 0.0503})
    stamps = TIME + 0.0503
    run = simulate(model, stamps, zero_order_hold(TIME, CHIRP), initial=START, max_step=max_step)
    np.testing.assert_allclose(run.physical, TIME, atol=1e-15)
    assert np.ptp(run.position) > 0.02
    deviation = np.max(np.abs(run.position - switching_reference(TIME)))
    assert deviation < error
    np.testing.assert_array_equal(run.output, run.position)


def test_a_smooth_machine_under_held_commands_is_exact_to_rounding_at_the_default_step():
    knots = TIME[::7] + 0.0123
    position = reference(SMOOTH, knots, CHIRP[::7], START, TIME[-1])
    run = simulate(SMOOTH, TIME, zero_order_hold(knots, CHIRP[::7]), initial=START)
    np.testing.assert_allclose(run.position, position(TIME), atol=2e-12)


def test_the_error_falls_with_the_fourth_power_of_the_step():
    """Also with commands that jump: no step crosses a jump."""
    knots = np.array([0.0, 0.32, 0.704, 1.12])  # whole steps, so that halving the step halves every step
    values = np.array([1.0, -2.0, 0.5, 3.0])
    times = np.array([0.0, 0.896, 1.44])
    exact = reference(SMOOTH, knots, values, START, 1.44)(times)

    def error(max_step):
        run = simulate(SMOOTH, times, zero_order_hold(knots, values), initial=START, max_step=max_step)
        return np.max(np.abs(run.position - exact))

    errors = np.array([error(step) for step in (0.016, 0.008, 0.004, 0.002)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all((orders > 3.8) & (orders < 4.4)), orders


def test_free_decay_is_the_damped_oscillation_of_the_textbook():
    free = Model.from_text(
        "inertia: {mass: 2.0}\nforce:\n- linear_spring: {stiffness: 50.0}\n- viscous_damper: {damping: 3.0}"
    )
    t = np.linspace(0, 5, 400)
    rate, omega = 3.0 / 4.0, math.sqrt(50 / 2 - (3 / 4) ** 2)
    exact = np.exp(-rate * t) * 0.1 * (np.cos(omega * t) + rate / omega * np.sin(omega * t))
    run = simulate(free, t, initial=(0.1, 0.0))
    np.testing.assert_allclose(run.position, exact, atol=1e-11)


def test_a_measurement_delay_shows_the_same_motion_later():
    stamps = np.arange(0.2, 1.4, 1e-3)
    late = HOPPER.with_values({"measurement_delay.delay": 0.0371})
    command = zero_order_hold(TIME, CHIRP)
    begin = simulate(HOPPER, np.array([0.0, stamps[0] - 0.0371]), command, initial=START).states[-1]
    delayed = simulate(late, stamps, command, initial=begin)
    undelayed = simulate(HOPPER, stamps - 0.0371, command, initial=begin)
    np.testing.assert_array_equal(delayed.output, undelayed.output)
    np.testing.assert_allclose(delayed.physical, stamps - 0.0371, atol=1e-15)


def test_an_input_delay_moves_the_command_and_not_the_forcing():
    late = HOPPER.with_values({"input_delay.delay": 0.0371})
    run = simulate(late, TIME, zero_order_hold(TIME, CHIRP), initial=START)
    moved = simulate(HOPPER, TIME, zero_order_hold(TIME + 0.0371, CHIRP), initial=START)
    np.testing.assert_array_equal(run.position, moved.position)
    np.testing.assert_allclose(run.effort[:37], np.cos(2 * np.pi * TIME[:37]), atol=1e-12)


def test_the_effort_is_forcing_plus_command_as_it_acts():
    run = simulate(HOPPER, TIME, zero_order_hold(TIME, CHIRP), initial=START)
    np.testing.assert_allclose(run.effort, np.cos(2 * np.pi * TIME) + CHIRP, atol=1e-12)


def test_a_recorded_forcing_drives_like_the_element_that_generates_it():
    grid = np.arange(-10, 1600) * 1e-3
    recorded = simulate(
        HOPPER.without("periodic_forcing"),
        TIME,
        forcing=spline(grid, np.cos(2 * np.pi * grid)),
        initial=START,
    )
    np.testing.assert_allclose(recorded.position, simulate(HOPPER, TIME, initial=START).position, atol=1e-11)


def test_a_smooth_command_is_followed_within_its_pieces():
    """A triangle wave, joined by straight lines, against the same integrated as a held rate of change."""
    knots = np.array([0.0, 0.5, 1.5])
    triangle = first_order_hold(knots, np.array([0.0, 1.0, -1.0]))
    mass = Model.from_text("inertia: {mass: 1.0}")
    t = np.array([0.0, 0.25, 0.5, 1.0, 1.5])
    exact = np.where(t <= 0.5, t**3 / 3, 1 / 24 + 0.25 * (t - 0.5) + (t - 0.5) ** 2 / 2 - (t - 0.5) ** 3 / 3)
    np.testing.assert_allclose(simulate(mass, t, triangle).position, exact, atol=1e-14)


@given(some.sets(some.integers(0, 1499), min_size=2, max_size=30))
def test_irregular_sampling_sees_the_same_motion(indices):
    full = simulate(HOPPER, TIME, zero_order_hold(TIME, CHIRP), initial=START)
    chosen = np.array(sorted(indices | {0}))
    some_of_it = simulate(HOPPER, TIME[chosen], zero_order_hold(TIME, CHIRP), initial=START)
    np.testing.assert_allclose(some_of_it.position, full.position[chosen], atol=1e-13)


def test_only_a_seed_brings_noise_and_the_same_seed_the_same_noise():
    noisy = HOPPER.with_element(load_catalogue()["measurement_noise"], {"std": 1e-3})
    clean = simulate(noisy, TIME, initial=START)
    np.testing.assert_array_equal(clean.output, clean.position)
    first, again, other = (simulate(noisy, TIME, initial=START, seed=seed).output for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)
    assert np.std(first - clean.position) == pytest.approx(1e-3, rel=0.1)


def test_elements_act_along_the_path_in_their_order():
    """Lag of the command, then the forcing joins, then the actuator's gain acts on both."""
    catalogue = load_catalogue()
    model = Model.from_text("inertia: {mass: 1.0}\nforce: [{periodic_forcing: {amplitude: 1, frequency: 1}}]")
    for name, values in (("actuator_gain", {"gain": 3.0}), ("command_lag", {"time_constant": 0.1})):
        model = model.with_element(catalogue[name], values)
    run = simulate(model, TIME, zero_order_hold(np.array([0.0]), np.array([2.0])))
    exact = 3.0 * (np.cos(2 * np.pi * TIME) + 2.0 * (1 - np.exp(-TIME / 0.1)))
    np.testing.assert_allclose(run.effort, exact, atol=1e-9)


def test_models_that_differ_in_values_share_one_compiled_function():
    from rhythmid.simulation.compiled import compile_model

    assert (
        compile_model(HOPPER).run is compile_model(HOPPER.with_values({"linear_spring.stiffness": 9.0})).run
    )


@pytest.mark.parametrize("times", [np.array([]), np.array([0.0, 1.0, 0.5]), np.array([0.0, np.nan])])
def test_times_that_do_not_increase_are_refused(times):
    with pytest.raises(InputError, match="times must increase"):
        simulate(HOPPER, times)


def test_a_diverging_simulation_is_refused_with_the_time():
    unstable = HOPPER.with_values({"linear_spring.stiffness": -1e7})
    with pytest.raises(InputError, match=r"the simulation diverges at t = [0-9.e-]+ s"):
        simulate(unstable, TIME, initial=START)


def test_the_default_step_is_a_quarter_of_a_sample_at_1_khz():
    assert MAX_STEP == 2.5e-4
