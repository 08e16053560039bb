"""Dead times inside the machine, against integrations of the delay differential equations by the method of steps."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.elements.element import Element, Parameter
from rhythmid.errors import InputError
from rhythmid.ltp.htf import linearised
from rhythmid.ltp.pumping import Pumping
from rhythmid.model import Model
from rhythmid.simulation.signal import spline, zero_order_hold
from rhythmid.simulation.simulate import simulate

CATALOGUE = load_catalogue()
GAIN, RATE, SPRING = 300.0, 14.0, 40.0
SERVO = Model.from_text(
    f"""
inertia: {{mass: {{value: 1.0, unit: kg, fixed: true}}}}
command:
  - position_control: {{proportional: {{value: {GAIN}, unit: N/m}}, derivative: {{value: {RATE}, unit: N*s/m}}}}
force:
  - linear_spring: {{stiffness: {{value: {SPRING}, unit: N/m}}, rest_length: {{value: 0.0, unit: m}}}}
""",
    catalogue=CATALOGUE,
)
START = (0.02, 0.3)
TIME = np.arange(0.0, 0.6, 1e-3)
KNOTS = np.arange(0.0, 1.0, 0.02)
REFERENCE = 0.1 * np.random.default_rng(0).standard_normal(len(KNOTS))
SIGNALS = {"held": zero_order_hold(KNOTS, REFERENCE), "smooth": spline(KNOTS, REFERENCE)}
DELAYS = ("actuator_delay", "feedback_delay")


def late(name: str, delay: float) -> Model:
    return SERVO.with_element(CATALOGUE[name], {"delay": delay})


def method_of_steps(name: str, delay: float, reference) -> np.ndarray:
    """Positions at TIME: one stretch after the other, in which everything that is late is known and nothing jumps."""
    rate = GAIN * (reference(0.0) - START[0]) - RATE * START[1] - SPRING * START[0]
    known = [
        (-np.inf, 0.0, lambda t: np.array([START[0] + START[1] * t + 0.5 * rate * t**2, START[1] + rate * t]))
    ]

    def earlier(t: float) -> np.ndarray:
        return next(path(t) for begin, end, path in known if t <= end + 1e-12)

    stops = {
        0.0,
        0.6,
        *np.arange(delay, 0.6, delay),
        *KNOTS[KNOTS < 0.6],
        *(KNOTS[KNOTS < 0.6 - delay] + delay),
    }
    state = np.array(START)
    for begin, end in pairwise(sorted(stops)):
        if end - begin < 1e-12:
            continue

        def right_hand_side(t, s, begin=begin, end=end):
            x, v = earlier(t - delay)
            shift = delay if name == "actuator_delay" else 0.0
            r = reference(np.clip(t, begin + 1e-12, end - 1e-12) - shift)
            return [s[1], GAIN * (r - x) - RATE * v - SPRING * s[0]]

        solution = solve_ivp(right_hand_side, (begin, end), state, rtol=1e-10, atol=1e-12, dense_output=True)
        known.append((begin, end, solution.sol))
        state = solution.y[:, -1]
    return np.array([earlier(t)[0] for t in TIME])


@pytest.mark.parametrize("name", DELAYS)
@pytest.mark.parametrize("delay", [0.0371, 0.0133])
def test_a_controlled_machine_with_a_dead_time_moves_as_the_method_of_steps_says(name, delay):
    def held(t: float) -> float:
        return REFERENCE[np.searchsorted(KNOTS, t, side="right") - 1] if t >= 0.0 else 0.0

    got = simulate(late(name, delay), TIME, SIGNALS["held"], initial=START).position
    assert got == pytest.approx(method_of_steps(name, delay, held), abs=3e-7)


@pytest.mark.parametrize("name", DELAYS)
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_dead_time_grows_smoothly_from_nothing_through_the_length_of_a_step(name, signal):
    delays = np.linspace(0.0, 1.2e-3, 13)
    paths = np.array(
        [
            simulate(late(name, d), TIME, SIGNALS[signal], initial=START, max_step=5e-4).position
            for d in delays
        ]
    )
    assert np.array_equal(
        paths[0], simulate(SERVO, TIME, SIGNALS[signal], initial=START, max_step=5e-4).position
    )
    slopes = np.diff(paths, axis=0) / np.diff(delays)[:, None]
    bends = np.linalg.norm(np.diff(slopes, axis=0), axis=1) / np.linalg.norm(slopes[0])
    assert bends.max() < 0.01


@pytest.mark.parametrize("delay", [0.0, 7e-5, 0.0123, 0.2])
def test_without_a_controller_an_actuator_delay_is_a_delay_of_the_measurement(rig, delay):
    """All that drives the machine comes later, so the motion does; a held command's jumps come through the delay as jumps."""
    model = rig.hopper.with_element(CATALOGUE["actuator_delay"], {"delay": delay})
    rng = np.random.default_rng(1)
    command = zero_order_hold(np.arange(0.3, 1.5, 7e-4), 3.0 * rng.standard_normal(1715))
    times = np.arange(0.0, 1.5, 1e-3)
    start = (0.2 - 9.81 / 200.0, 0.0)  # at rest
    prompt = simulate(rig.hopper, times - delay, command, initial=start).position
    got = simulate(model, times, command, initial=start)
    assert got.position == pytest.approx(
        prompt, abs=1e-8
    )  # the damper switches within steps that lie elsewhere
    assert got.effort[times < 0.3 + delay] == pytest.approx(0.0)


@pytest.mark.parametrize("delays", [(0.012, 0.0), (0.0, 0.012), (0.02, 0.008)])
def test_transfer_function_and_cycle_of_a_controlled_machine_with_dead_times_are_those_of_theory(delays):
    """For the loop with e^(-s(tau_a + tau_f)); a linear machine answers at no other frequency."""
    model = SERVO
    for name, delay in zip(DELAYS, delays, strict=True):
        model = model.with_element(CATALOGUE[name], {"delay": delay}) if delay else model
    frequency = np.array([0.3, 1.3, 3.1, 7.2])
    machine = linearised(model, Pumping.cosine(1.0, 1.0), effort=0.1)
    got = machine.htf(np.array([0, 1]), frequency)

    def loop(s):
        return s**2 + SPRING + np.exp(-s * sum(delays)) * (GAIN + RATE * s)

    s, w = 2j * np.pi * frequency, 2j * np.pi
    assert got[0] == pytest.approx(GAIN * np.exp(-s * delays[0]) / loop(s), rel=3e-6)
    assert np.abs(got[1]).max() < 1e-6 * np.abs(got[0]).max()
    assert machine.cycle.harmonics(1)[1] == pytest.approx(0.5 * np.exp(-w * delays[0]) / loop(w), rel=1e-8)


def test_a_delay_of_a_controllers_measurement_needs_a_controller():
    with pytest.raises(InputError, match="feedback_delay.* needs 'position_control'"):
        SERVO.without("position_control").with_element(CATALOGUE["feedback_delay"], {"delay": 0.01})


def test_an_element_with_a_history_names_a_signal_of_its_kernel_and_a_dead_time():
    given = {
        "name": "late", "slot": "actuator", "title": "", "equation": "", "reference": "",
        "parameters": (Parameter("delay", "s", "", bounds=(0.0, 1.0)),), "kernel": lambda f, t, delay, past_f: past_f,
    }  # fmt: skip
    assert Element(**given, history=("f",), dead_time="delay").arguments == ("f", "t", "delay", "past_f")
    with pytest.raises(TypeError, match="history names 'x'"):
        Element(**given, history=("x",), dead_time="delay")
    with pytest.raises(TypeError, match="needs a parameter that is its dead_time"):
        Element(**given, history=("f",))
    endless = given | {"parameters": (Parameter("delay", "s", "", bounds=(0.0, np.inf)),)}
    with pytest.raises(TypeError, match="with bounds from 0 to at most 1 s"):
        Element(**endless, history=("f",), dead_time="delay")
