"""Timing as on robots, concealed in the machine: estimated or compensated, and the delays right all the same."""

from dataclasses import replace

import numpy as np
import pytest

from machines import CATALOGUE, hopper, record, records
from rhythmid.elements.random_delay import uniform_delay
from rhythmid.identify.free_run import prepare_run
from rhythmid.identify.identification import Estimate
from rhythmid.identify.joint import JointFit, joint_likelihood
from rhythmid.identify.noise import NoiseModel
from rhythmid.identify.output_error import Fit, minimise, start_only
from rhythmid.identify.series import prepare
from rhythmid.identify.timing import (
    _first_samples,
    _simulated,
    command_hold,
    compensated,
    measurement_jitter,
)
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

U, Y = "input_delay.delay", "measurement_delay.delay"
SPEC = {"type": "chirp", "amplitude": 0.3, "band": [0, 7], "sweep": 8.0}
DELAYS = (0.04, 0.055)


def concealing(name: str, **values: float) -> Record:
    return record(hopper().with_element(CATALOGUE[name], values), SPEC, delays=DELAYS, std=5e-6)


def fitted(made: Record) -> JointFit:
    return joint_likelihood(made, hopper())


def lost(channel: Channel | None, share: float, seed: int) -> Channel:
    assert channel is not None
    kept = np.random.default_rng(seed).random(len(channel)) > share
    kept[0] = True
    return replace(channel, time=channel.time[kept], value=channel.value[kept])


def near(joint: JointFit, name: str, truth: float, least: float = 2e-5) -> bool:
    return abs(joint.fit.model.value(name) - truth) < max(5.0 * joint.fit.std[name], least)


def test_a_skewed_clock_is_found_and_taken_out():
    found, notes = compensated(fitted(concealing("clock_skew", skew=5e-5)))
    assert len(notes) == 1 and "µs/s" in notes[0]
    assert near(found, U, DELAYS[0]) and near(found, Y, DELAYS[1])


def test_channels_of_one_clock_have_no_skew():
    joint = fitted(concealing("clock_skew", skew=5e-5))
    series = tuple(replace(one, one_clock=True) for one in joint.fit.run.series)
    same = replace(joint, fit=replace(joint.fit, run=replace(joint.fit.run, series=series)))
    found, notes = compensated(same)
    assert found.fit.model.term("clock_skew") is None and not any("clocks" in note for note in notes)


def test_a_drift_that_the_scores_of_blocks_do_not_bear_out_is_none(monkeypatch):
    joint = fitted(concealing("clock_skew", skew=5e-5))

    def doubtful(fit: Fit) -> Fit:
        return replace(fit, covariance=fit.covariance * 1e8)

    monkeypatch.setattr("rhythmid.identify.timing.with_robust_covariance", doubtful)
    found, notes = compensated(joint)
    assert notes == () and found.fit is joint.fit


def test_a_drifting_input_delay_is_found_and_taken_out():
    found, notes = compensated(fitted(concealing("input_delay_drift", rate=5e-4)))
    assert "the input delay drifts" in notes[0]
    rate = found.fit.model.value("input_delay_drift.rate")
    assert rate == pytest.approx(5e-4, rel=0.02)
    assert near(found, U, DELAYS[0], 5e-5) and near(found, Y, DELAYS[1])


@pytest.mark.parametrize("period", [0.0137, pytest.param(0.0333, marks=pytest.mark.long)])
def test_a_command_held_at_any_slower_rate_is_found(period):
    joint = fitted(concealing("command_hold", period=period))
    assert joint.fit.model.value(U) == pytest.approx(DELAYS[0] + 0.5 * period, abs=1e-3)  # unless modelled
    found, told = command_hold(joint)
    assert told.value == pytest.approx(period, abs=3.0 * told.std) and told.std < 0.1 * period
    assert found.fit.model.value(U) == pytest.approx(DELAYS[0], abs=min(3.0 * found.fit.std[U], 1.5e-3))
    assert near(found, Y, DELAYS[1], 4e-5)


def test_a_held_command_is_told_and_half_its_period_taken_out_of_the_delay():
    found, (note,) = compensated(fitted(concealing("command_hold", period=0.02)))
    assert "as if the drive took a new one every" in note
    assert near(found, U, DELAYS[0]) and found.fit.std[U] < 1e-3


def test_a_hold_with_which_the_machine_would_answer_before_it_is_asked_is_none():
    made = concealing("command_hold", period=0.0333)
    assert made.input is not None
    late = replace(made.input, time=made.input.time + 0.05)  # stamps: the delay beside a hold is -0.01 s
    joint = fitted(replace(made, input=late))
    found, told = command_hold(joint)
    assert told.value is None and found is joint


def test_good_timing_is_left_alone():
    joint = fitted(record(hopper(), SPEC, delays=DELAYS, std=5e-6))
    found, notes = compensated(joint)
    assert notes == () and found.fit is joint.fit
    jitter = measurement_jitter(joint.fit)
    assert jitter.value is not None and jitter.value < 2e-5


def test_measurement_jitter_is_read_off_residuals_that_grow_with_speed():
    made = record(hopper(), SPEC, delays=DELAYS, std=5e-6)
    output = made.output
    late = uniform_delay(output.time, 2e-4, 3.0)
    aged = np.interp(output.time - late, output.time, output.value)
    joint = fitted(replace(made, output=replace(output, value=aged)))
    jitter = measurement_jitter(joint.fit)
    assert jitter.value == pytest.approx(2e-4, rel=0.05)
    assert near(joint, U, DELAYS[0], 5e-5) and near(joint, Y, DELAYS[1] + late.mean())  # its mean is a delay


@pytest.mark.parametrize("noise", [0.1, 0.0])
def test_a_motion_of_one_speed_tells_no_jitter(noise):
    text = """
units: {force: "rad/s^2", position: rad, mass: "1"}
inertia: {mass: {value: 1, unit: "1", fixed: true}}
force: [{viscous_damper: {damping: {value: 0.0, unit: "1/s"}}}]
"""
    time = np.arange(0.0, 10.0, 0.01)
    speed = 9.0 + noise * np.random.default_rng(0).standard_normal(len(time))
    series = prepare([Record("spins", Channel(time, speed, "rad/s"), output_kind="velocity")])
    even = start_only(Model.from_text(text, catalogue=CATALOGUE), series, NoiseModel(np.empty(0), 0.1), 0.01)
    assert measurement_jitter(even) == Estimate(None, None, "s")


def test_a_fit_that_leaves_nothing_has_no_jitter():
    exact = fitted(record(hopper(), SPEC, delays=DELAYS, std=5e-6)).fit
    simulated = [
        replace(one, value=np.concatenate([_simulated(exact, i)[0], one.value[one.blocks * one.block :]]))
        for i, one in enumerate(exact.run.series)
    ]
    exact = replace(exact, run=replace(exact.run, series=tuple(simulated)))
    assert measurement_jitter(exact) == Estimate(0.0, 0.0, "s")


def test_lost_samples_of_every_channel_do_no_harm():
    made = record(hopper(), SPEC, delays=DELAYS, std=5e-6)
    thin = replace(
        made,
        input=lost(made.input, 0.02, 1),
        output=lost(made.output, 0.05, 2),
        forcing=lost(made.forcing, 0.05, 3),
    )
    joint = fitted(thin)
    assert near(joint, U, DELAYS[0]) and near(joint, Y, DELAYS[1])


def test_input_and_output_at_different_rates_do_no_harm():
    made = record(hopper(), SPEC, delays=DELAYS, std=5e-6)
    assert made.forcing is not None
    slow = replace(
        made,
        output=replace(made.output, time=made.output.time[::4], value=made.output.value[::4]),
        forcing=replace(made.forcing, time=made.forcing.time[::10], value=made.forcing.value[::10]),
    )
    joint = fitted(slow)
    assert near(joint, U, DELAYS[0]) and near(joint, Y, DELAYS[1])


def test_what_many_records_tell_of_a_roll_off_is_asked_of_the_first_that_are_long_enough():
    series = prepare(records(hopper(), std=0.0))
    run = prepare_run(hopper(), series)
    fit = minimise(hopper(), run, hopper().free, iterations=0)
    assert len(series) > 1 and _first_samples(fit, 10**9) is fit
    first = _first_samples(fit, 100)
    assert [one.name for one in first.run.series] == [series[0].name]
    assert len(first.starts) == len(first.residuals) == 1 and first.model is fit.model
