"""Signals between their samples: held, joined, or band-limited."""

import numpy as np
import pytest
from scipy.integrate import simpson

from rhythmid.simulation.signal import (
    FAR,
    band_limited,
    first_order_hold,
    impulse_preserving,
    pieces,
    spline,
    zero_order_hold,
)

TIME = np.arange(2000) * 1e-3


def evaluate(signal, at):
    """What the compiled simulator makes of a signal: its pieces at any times."""
    knots, coefficients = pieces(signal)
    index = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    local = np.where(np.abs(knots[index]) < FAR / 2, at - knots[index], 0.0)
    c = np.zeros((4, len(index)))
    c[: len(coefficients)] = coefficients[:, index]
    return c[0] + local * (c[1] + local * (c[2] + local * c[3]))


def test_a_held_command_keeps_each_value_until_the_next():
    held = zero_order_hold(np.array([1.0, 2.0, 4.0]), np.array([5.0, -1.0, 3.0]))
    at = np.array([-10.0, 0.999, 1.0, 1.999, 2.0, 3.9, 4.0, 1e6])
    np.testing.assert_array_equal(evaluate(held, at), [0, 0, 5, 5, -1, -1, 3, 3])


def test_straight_lines_join_the_samples_and_keep_the_ends():
    joined = first_order_hold(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, -2.0]))
    np.testing.assert_allclose(evaluate(joined, np.array([-5, 0.5, 1, 2, 3, 99.0])), [0, 1, 2, 0, -2, -2])


def test_a_spline_follows_a_well_sampled_forcing():
    time = np.arange(0, 3, 1e-3)
    signal = spline(time, np.cos(2 * np.pi * time))
    at = np.linspace(0, 2.9, 977)
    np.testing.assert_allclose(evaluate(signal, at), np.cos(2 * np.pi * at), atol=1e-11)


def test_a_spline_of_two_samples_is_a_straight_line():
    np.testing.assert_allclose(
        evaluate(spline(np.array([0.0, 1.0]), np.array([1.0, 3.0])), np.array([0.5])), [2.0]
    )


@pytest.mark.parametrize(("share", "error"), [(0.02, 1e-8), (0.1, 3e-6), (0.25, 1e-4), (0.4, 6e-4)])
def test_a_band_limited_signal_is_found_between_its_samples(share, error):
    """`share` is the frequency over the sample rate; a straight line between samples errs by 2e-3 at a share of 0.02."""
    omega = 2 * np.pi * share / 1e-3
    signal = band_limited(TIME, np.sin(omega * TIME + 0.3))
    at = np.linspace(0.5, 1.5, 4567)  # away from the ends
    np.testing.assert_allclose(evaluate(signal, at), np.sin(omega * at + 0.3), atol=error)


def test_a_band_limited_signal_passes_through_its_samples_up_to_the_ends():
    values = np.random.default_rng(1).standard_normal(len(TIME))
    np.testing.assert_allclose(evaluate(band_limited(TIME, values), TIME), values, atol=1e-10)


def test_a_band_limited_ramp_stays_a_ramp():
    at = np.linspace(0.0, TIME[-1], 999)
    np.testing.assert_allclose(evaluate(band_limited(TIME, 3 * TIME - 1), at), 3 * at - 1, atol=1e-12)


def test_the_smooth_surrogate_of_a_held_command_has_its_impulse():
    values = np.sin(2 * np.pi * 7 * TIME) ** 2
    smooth = impulse_preserving(zero_order_hold(TIME, values))
    for first, last in [(100, 1500), (0, 1999)]:
        expected = np.sum(values[first:last]) * 1e-3
        assert smooth.integrate(TIME[first], TIME[last]) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("frequency", [3.0, 12.0])
def test_the_smooth_surrogate_of_a_held_command_is_its_equal_at_low_frequencies(frequency):
    values = np.sin(2 * np.pi * 7 * TIME) * np.hanning(len(TIME))
    smooth = impulse_preserving(zero_order_hold(TIME, values))
    omega = 2.0 * np.pi * frequency
    edges = np.exp(-1j * omega * np.append(TIME, TIME[-1] + 1e-3))
    exact = np.sum(values * (edges[:-1] - edges[1:])) / (1j * omega)
    fine = np.linspace(TIME[0], TIME[-1], 40 * (len(TIME) - 1) + 1)
    found = simpson(smooth(fine) * np.exp(-1j * omega * fine), x=fine)
    assert abs(found - exact) < 2e-7 * abs(np.sum(np.abs(values)) * 1e-3)


def test_the_smooth_surrogate_of_a_held_command_is_nothing_before_it():
    smooth = impulse_preserving(zero_order_hold(TIME, np.sin(2 * np.pi * 7 * TIME)))
    assert np.all(np.abs(evaluate(smooth, np.array([-1.0, -0.1]))) < 1e-12)


def test_no_signal_is_zero():
    np.testing.assert_array_equal(evaluate(None, np.array([-1e9, 0.0, 1e9])), 0.0)
