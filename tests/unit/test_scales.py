"""Scales: what the records tell about sizes."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.simulation.signal import spline


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


def test_a_limit_is_looked_for_just_below_the_highest_force_too():
    """A peak that is cut off once lies far above the usual forces."""
    one = forced(1.0, 10.0)
    peak = spline(one.time, 3.0 * np.exp(-(((one.time - 4.0) / 0.1) ** 2)))
    sizes = scales([replace(one, command=peak)], hopper())
    highest = float(np.abs(peak(one.time) + np.sin(2.0 * np.pi * one.time + 0.3)).max())
    assert sizes.peak_effort == pytest.approx(highest)
    starts = CATALOGUE["actuator_saturation"].starts
    assert starts is not None
    assert any(0.95 * highest < start["limit"] < highest for start in starts(sizes))
    assert not starts(replace(sizes, effort=0.0, peak_effort=0.0))


def test_a_voltage_is_not_taken_for_the_force_of_the_motor_that_it_feeds():
    one = replace(forced(1.0, 10.0), forcing=None)
    driven = replace(one, command=spline(one.time, 100.0 * np.sin(one.time)))
    motor = hopper().with_element(CATALOGUE["dc_motor"], {"torque_constant": 0.01, "resistance": 10.0})
    assert scales([driven], hopper()).effort > 50.0
    sizes = scales([driven], motor)
    assert sizes.effort == pytest.approx(sizes.force) and sizes.peak_effort == 0.0
