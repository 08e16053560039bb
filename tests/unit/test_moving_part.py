"""The frequency and the bandwidth of a motion that dies out early are those of the motion, not of what follows it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import chirp, lfilter

from rhythmid.identify.motion_band import bandwidth, moving_part
from rhythmid.identify.series import dominant_frequency, prepare
from rhythmid.record.record import Channel, Record

RATE, FREQUENCY = 50.0, 2.7


def decay(damping, duration=10.0, offset=0.02, noise=1e-4, seed=0):
    """A released oscillator, at rest away from zero in the end, with noise."""
    time = np.arange(int(duration * RATE)) / RATE
    angle = 2 * np.pi * FREQUENCY * time
    motion = np.exp(-damping * angle) * np.cos(angle * np.sqrt(1.0 - damping**2))
    return offset + motion + noise * np.random.default_rng(seed).standard_normal(len(time))


def series(value):
    return prepare([Record("decay", Channel(np.arange(len(value)) / RATE, value, "m"))])[0]


@settings(max_examples=30, deadline=None)
@given(st.floats(0.005, 0.6), st.floats(5.0, 40.0), st.floats(-2.0, 2.0), st.integers(0, 50))
def test_the_dominant_frequency_of_a_decay_is_the_oscillators(damping, duration, offset, seed):
    found = dominant_frequency(series(decay(damping, duration, offset, seed=seed)))
    assert 0.4 * FREQUENCY < found < 1.6 * FREQUENCY


@pytest.mark.parametrize("damping", [0.02, 0.2, 0.6])
def test_a_decay_is_not_averaged_away(damping):
    assert series(decay(damping)).block <= 2


def test_a_steady_motion_is_taken_as_it_is():
    time = np.arange(1000) / RATE
    value = np.sin(2 * np.pi * 1.3 * time)
    assert len(moving_part(value)) == len(value)
    assert bandwidth(value, 1 / RATE) < 2.0
    assert len(moving_part(np.zeros(100))) == 100 and len(moving_part(np.ones(3))) == 3


@pytest.mark.parametrize("seed", range(5))
def test_noise_is_no_power_of_the_motion(seed):
    time = np.arange(0.0, 20.0, 1e-3)
    noise = np.random.default_rng(seed).normal(size=len(time))
    value = np.sin(2 * np.pi * 1.7 * time) + 0.1 * noise
    assert bandwidth(value, 1e-3) < 2.5


@pytest.mark.parametrize("colour", [0.5, 0.9, 0.97])
@pytest.mark.parametrize("size", [0.01, 0.03, 0.1])
def test_coloured_noise_is_no_power_of_the_motion(colour, size):
    time = np.arange(0.0, 20.0, 1e-3)
    noise = lfilter([1.0], [1.0, -colour], np.random.default_rng(1).normal(size=len(time)))
    value = np.sin(2 * np.pi * 1.7 * time) + size / np.std(noise) * noise
    assert bandwidth(value, 1e-3) < 2.5


def test_a_broad_motion_is_not_taken_for_noise():
    time = np.arange(0.0, 20.0, 1e-3)
    noise = lfilter([1.0], [1.0, -0.9], np.random.default_rng(1).normal(size=len(time)))
    value = chirp(time, 0.5, 20.0, 60.0) + 0.01 / np.std(noise) * noise
    assert 50.0 < bandwidth(value, 1e-3) < 65.0
