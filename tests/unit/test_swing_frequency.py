"""The frequencies between which a free motion swings."""

import numpy as np
import pytest

from rhythmid.identify.series import prepare
from rhythmid.identify.swing_frequency import swing_frequencies
from rhythmid.record.record import Channel, Record

TIME = np.arange(0.0, 60.0, 0.01)


def decay(value: np.ndarray) -> Record:
    return Record("decay", Channel(TIME, value, "rad"))


def test_of_a_linear_decay_they_are_one():
    low, high = swing_frequencies(prepare([decay(np.exp(-0.03 * TIME) * np.cos(2.0 * np.pi * 1.3 * TIME))]))
    assert low == pytest.approx(1.3, rel=0.01) and high == pytest.approx(1.3, rel=0.01)


def test_of_a_swing_that_gets_faster_as_it_decays_they_are_those_of_its_amplitudes():
    rate = 1.0 + 0.2 * TIME / TIME[-1]
    phase = 2.0 * np.pi * np.cumsum(rate) * 0.01
    noise = 0.01 * np.random.default_rng(0).standard_normal(len(TIME))
    low, high = swing_frequencies(prepare([decay(np.exp(-0.03 * TIME) * np.cos(phase) + noise)]))
    assert 0.99 < low < 1.05 and 1.13 < high < 1.21


def test_a_motion_that_never_returns_has_none():
    assert swing_frequencies(prepare([decay(np.exp(-TIME))])) == (0.0, 0.0)
