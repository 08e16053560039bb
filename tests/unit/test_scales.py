"""Scales: what the records tell about sizes."""

import numpy as np
import pytest

from machines import hopper
from rhythmid.identify.series import Series, scales
from rhythmid.signal import spline


def forced(frequency: float, seconds: float) -> Series:
    """A record of so many seconds under a sinusoidal forcing."""
    time = 5e-3 * np.arange(round(seconds / 5e-3))
    forcing = spline(time, np.sin(2.0 * np.pi * frequency * time + 0.3))
    used = np.ones(len(time), bool)
    return Series("made", time, 0.01 * np.sin(2 * np.pi * time), None, forcing, 1, used, 5e-3)


@pytest.mark.parametrize("frequency", [0.7, 0.98, 1.0, 1.31])
def test_the_forcing_s_frequency_is_told_finer_than_the_longest_record_resolves(frequency):
    records = [forced(frequency, 30.0), forced(frequency, 7.0)]
    assert scales(records, hopper()).forcing_frequency == pytest.approx(frequency, abs=0.1 / 30.0)
