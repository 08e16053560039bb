"""What must go in for a given signal to come out; friction under load is under the effort that makes up for it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from rhythmid.identify.inverse_dynamics.balance import Balance
from rhythmid.identify.inverse_dynamics.inversion import Inversions, followed, inverted
from rhythmid.identify.inverse_dynamics.motion import low_pass
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

TIME = np.arange(0.0, 20.0, 0.002)
WAVE = 0.8 * np.sin(2 * np.pi * 0.6 * TIME) + 0.3 * np.sin(2 * np.pi * 1.7 * TIME + 1.0)


@given(st.floats(0.3, 3.0), st.floats(0.0, 0.5), st.floats(-1.0, 1.0))
def test_what_goes_in_brings_out_what_is_wanted(gain, bend, offset):
    def comes_out(signal):
        return gain * signal + bend * np.tanh(3.0 * (signal - offset))

    np.testing.assert_allclose(comes_out(inverted(comes_out, WAVE, remembers=False).into), WAVE, atol=1e-4)


@given(st.floats(0.3, 3.0), st.floats(0.0, 0.5), st.floats(-1.0, 1.0))
def test_a_small_change_of_what_is_inverted_is_followed_in_one_run(gain, bend, offset):
    runs = 0

    def comes_out(signal, change=0.0):
        nonlocal runs
        runs += 1
        return (gain + change) * signal + (bend + change) * np.tanh(3.0 * (signal - offset))

    step, wanted = 1e-4, WAVE + 1e-4 * np.cos(WAVE)
    known = inverted(comes_out, WAVE, remembers=False, with_slope=True)
    runs = 0
    found = followed(known, lambda signal: comes_out(signal, step), wanted, remembers=False).into
    assert runs == 1
    anew = inverted(lambda signal: comes_out(signal, step), wanted, remembers=False).into
    np.testing.assert_allclose((found - known.into) / step, (anew - known.into) / step, atol=0.05)


def test_what_cannot_be_followed_is_inverted_anew():
    def dead(signal, band):
        return signal - np.clip(signal, -band, band)

    known = inverted(lambda signal: dead(signal, 0.2), WAVE, False, with_slope=True)
    by = Inversions({"dead": known})
    found = by.inverted("dead", lambda signal: dead(signal, 0.21), WAVE, False)
    np.testing.assert_array_equal(found, inverted(lambda signal: dead(signal, 0.21), WAVE, False).into)


def test_in_a_dead_band_and_beyond_a_limit_it_is_what_goes_in_to_first_order():
    def limited(signal):
        return np.clip(signal, -0.5, 0.5)

    def dead(signal):
        return signal - np.clip(signal, -0.2, 0.2)

    beyond = np.abs(WAVE) > 0.51
    np.testing.assert_allclose(
        inverted(limited, WAVE, False).into[beyond], (2 * WAVE - limited(WAVE))[beyond]
    )
    within, clear = np.abs(WAVE) < 0.19, np.abs(WAVE) > 0.21
    found = inverted(dead, WAVE, False).into
    np.testing.assert_allclose(found[within], (2 * WAVE - dead(WAVE))[within])
    np.testing.assert_allclose(dead(found)[clear], WAVE[clear], atol=1e-4)


def test_what_goes_into_a_lag_is_found_though_the_signal_has_parts_that_are_fast_beside_it():
    wanted = WAVE + 0.1 * np.random.default_rng(1).normal(size=len(TIME))
    keeps = np.exp(-0.002 / 0.01)

    def lagging(signal, keeps=keeps):
        return lfilter([0.5 * (1.0 - keeps), 0.5 * (1.0 - keeps)], [1.0, -keeps], signal)

    slow = np.clip(TIME, 0.0, 1.0) * low_pass(wanted, 0.002, 25.0)
    found = inverted(lagging, slow, remembers=True)
    error = lagging(found.into) - slow
    assert np.linalg.norm(error) < 1e-2 * np.linalg.norm(slow)
    moved = followed(found, lambda signal: lagging(signal, keeps + 1e-4), slow, remembers=True)
    anew = inverted(lambda signal: lagging(signal, keeps + 1e-4), slow, remembers=True)
    assert np.linalg.norm(moved.into - anew.into) < 0.1 * np.linalg.norm(anew.into - found.into)


def test_what_goes_into_a_limit_of_the_rate_is_told_to_first_order():
    def limited(signal):
        made, last = np.empty_like(signal), 0.0
        for place, value in enumerate(signal):
            made[place] = last = last + float(np.clip(value - last, -1e-3, 1e-3))
        return made

    found = inverted(limited, WAVE[:2000], remembers=True)
    np.testing.assert_allclose(found.into, 2.0 * WAVE[:2000] - limited(WAVE[:2000]))


@pytest.mark.parametrize("coefficient", [0.05, 0.15, 0.3])
@pytest.mark.parametrize("name", ["load_dependent_friction", "transmitted_load_friction"])
def test_friction_under_load_is_under_the_effort_that_makes_up_for_it(name, coefficient):
    """u = R + mu |u - r e| sgn v is linear in u on either side of its kink; e is the weight, which relieves the teeth."""
    inertia, weight, ratio, turn = 0.05, 2.0, 0.0 if name == "load_dependent_friction" else 0.5, 0.02
    velocity = np.gradient(WAVE, TIME)
    load = -weight * np.sin(WAVE)
    alone = inertia * np.gradient(velocity, TIME) - load
    sign = coefficient * np.tanh(velocity / turn)
    effort = (alone - sign * ratio * load) / (1.0 - sign)
    wrong_side = effort - ratio * load < 0.0
    effort[wrong_side] = ((alone + sign * ratio * load) / (1.0 + sign))[wrong_side]
    more = f", external_ratio: {{value: {ratio}, unit: '1'}}" if ratio else ""
    model = Model.from_text(
        f"inertia: {{mass: {{value: {inertia}, unit: kg*m^2}}}}\nforce:\n"
        f"  - pendulum_gravity: {{moment: {{value: {weight}, unit: N*m}}, reference: {{value: 0.0, unit: rad}}}}\n"
        f"  - {name}: {{coefficient: {{value: {coefficient}, unit: '1'}}, transition: {{value: {turn}, unit: rad/s}}{more}}}\n"
    )
    balance = Balance.of(
        [Record("run", Channel(TIME, WAVE, "rad"), Channel(TIME, effort, "N*m"), hold="linear")], model
    )
    error = balance.predicted(model) - balance.measured
    assert np.std(error) < 0.005 * np.std(balance.measured)
