"""Scales: what the records tell about sizes."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper
from rhythmid.identify.descent import first_guess
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.multiple_shooting import windows
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import Series
from rhythmid.simulation.signal import spline, zero_order_hold


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


def turning_speed() -> Series:
    """The speed of a machine that turns on and on, for 10 s."""
    time, used = 5e-3 * np.arange(2000), np.ones(2000, bool)
    return Series("turning", time, 2.0 + np.sin(3.0 * time), None, None, 1, used, 5e-3, measured="velocity")


def test_where_only_the_speed_is_measured_places_are_those_that_the_model_counts_from():
    turning = turning_speed()
    time, parts = turning.time, windows([turning], 2.0)
    sizes = scales(parts, hopper())
    covered = 2.0 * time + (1.0 - np.cos(3.0 * time)) / 3.0
    assert [one.origin for one in parts] == pytest.approx(
        np.interp([one.time[0] for one in parts], time, covered), abs=1e-3
    )
    assert (sizes.low, sizes.high) == pytest.approx((covered[0], covered[-1]), abs=0.05)


def test_windows_of_a_speed_begin_where_the_record_has_come_to():
    again = windows(windows([turning_speed()], 4.0), 2.0)
    model = hopper()
    begin = first_guess(model, prepare_run(model, again))
    assert [start[0] for start in begin] == [one.origin for one in again]
    assert len(again) == 5 and np.all(np.diff([one.origin for one in again]) > 2.0)


@pytest.mark.parametrize(
    ("begins", "changes", "idle"),
    [(0.0, 0.0, True), (0.002, 0.0, True), (3.0, 0.0, False), (0.0, 0.1, False)],
)
def test_an_input_that_is_constant_drives_nothing(begins, changes, idle):
    """Unless it begins within the record: no command had arrived before."""
    one = replace(forced(1.0, 10.0), forcing=None)
    time = one.time[one.time >= begins] if begins > one.period else one.time + begins
    constant = replace(one, command=zero_order_hold(time, 0.5 + changes * np.sin(time)))
    assert scales([constant], hopper()).idle == idle
    assert constant.commanded != idle and constant.driven != idle


def test_a_forcing_that_is_constant_drives_nothing_and_one_that_is_not_does():
    one = forced(1.0, 10.0)
    assert one.driven and not one.commanded
    assert not replace(one, forcing=spline(one.time[:-3], np.ones(len(one.time) - 3))).driven


def test_the_reference_of_a_curved_speed_sensor_lies_within_the_speeds_that_it_measured():
    turning = turning_speed()
    sizes = scales([turning], hopper())
    curved = CATALOGUE["sensor_nonlinearity"].within(sizes)
    speeds = turning.value.min(), turning.value.max()
    assert curved.parameter("reference").bounds == pytest.approx(speeds)
    assert all(speeds[0] < guess["reference"] < speeds[1] for guess in curved.first_guesses(sizes))
    assert sizes.high > 2.0 * speeds[1]
