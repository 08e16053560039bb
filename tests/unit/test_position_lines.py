"""Wavelengths of what repeats itself along the way, however the places are visited."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.elements.element import Scales
from rhythmid.identify.position_lines import strongest_wavelengths


@given(st.integers(0, 10_000), st.floats(5.0, 150.0), st.sampled_from(["turning", "to and fro", "at random"]))
def test_the_wavelength_of_a_ripple_in_noise_is_found_to_the_width_of_its_line(seed, waves, visited):
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, 6000)
    position = {
        "turning": time + 0.002 * np.sin(40.0 * time),
        "to and fro": np.sin(2 * np.pi * 1.7 * time) + 0.3 * np.sin(2 * np.pi * 2.9 * time),
        "at random": np.cumsum(rng.standard_normal(6000)) / 100.0,
    }[visited]
    travel = np.ptp(position)
    wavelength = travel / waves
    ripple = np.sin(2 * np.pi * position / wavelength + rng.uniform(0.0, 6.0))
    signal = ripple + 0.7 * rng.standard_normal(6000) + 0.5 * position / travel
    found = strongest_wavelengths(position, signal, travel / 400.0, 3)
    assert min(abs(travel / one - waves) for one in found) < 0.6


@pytest.mark.parametrize("position", [np.zeros(100), np.linspace(0.0, 1.0, 5)])
def test_without_travel_or_samples_there_is_no_line(position):
    assert strongest_wavelengths(position, np.ones(len(position)), 0.01, 3) == ()


def test_two_ripples_come_in_the_order_of_their_size():
    position = np.linspace(0.0, 100.0, 20_000)
    signal = np.sin(2 * np.pi * position / 0.9) + 2.0 * np.sin(2 * np.pi * position / 0.5)
    first, second = strongest_wavelengths(position, signal, 0.2, 2)
    assert first == pytest.approx(0.5, rel=1e-3) and second == pytest.approx(0.9, rel=1e-3)


def test_ripple_is_sought_where_lines_over_position_are_left():
    scales = Scales(1.0, 1.0, 1.0, 0.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.01, residual_wavelengths=(0.0123,))
    starts = load_catalogue()["position_ripple"].first_guesses(scales)
    assert {one["wavelength"] for one in starts} > {0.0123, 2.0}
