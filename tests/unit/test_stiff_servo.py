"""A servo that is as fast as its samples is fitted from gains of a slow one: no step is longer than the controller allows."""

import numpy as np

from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import continuous
from rhythmid.simulation.simulate import simulate

SERVO = """
inertia: {{mass: {{value: 1.0, unit: kg, fixed: true}}}}
command:
  - position_control: {{proportional: {{value: {proportional}, unit: N/m}}, derivative: {{value: {derivative}, unit: N*s/m}}}}
"""


def test_gains_of_a_servo_that_is_as_fast_as_its_samples_are_reached_from_those_of_a_slow_one():
    servo = Model.from_text(SERVO.format(proportional=5e4, derivative=400.0))
    time = 8e-3 * np.arange(1000)
    reference = Channel(time, np.sin(2.0 * time) + 0.5 * np.sin(1.3 * time), "m")
    value = simulate(servo, time, continuous(time, reference.value, "band_limited"), max_step=1e-3).output
    record = Record(
        "servo", Channel(time, value, "m"), reference, input_kind="reference", hold="band_limited"
    )
    series = prepare([record])
    assert series[0].block > 4
    fit = estimate(Model.from_text(SERVO.format(proportional=400.0, derivative=25.0)), series)
    assert fit.nrmse() < 1e-4  # the servo's lag alone is 1e-2


def test_a_servo_that_is_too_fast_for_one_step_a_sample_is_fitted_from_its_own_gains():
    servo = Model.from_text(SERVO.format(proportional=1.8e3, derivative=210.0))
    time = 0.02 * np.arange(300)
    reference = Channel(time, np.sin(2.0 * time) + 0.5 * np.sin(5.3 * time), "m")
    value = simulate(servo, time, continuous(time, reference.value, "band_limited"), max_step=1e-3).output
    record = Record(
        "servo", Channel(time, value, "m"), reference, input_kind="reference", hold="band_limited"
    )
    assert estimate(servo, prepare([record])).nrmse() < 1e-3
