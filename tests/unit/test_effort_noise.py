"""Noise of the recorded effort would drive a free run, so that the effort is then predicted from the motion instead."""

from dataclasses import replace

import numpy as np
import pytest
from axes import CATALOGUE

from rhythmid.identify.inverse_dynamics.applicability import applicable
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

RATE, LONG = 200.0, 30.0  # [Hz], [s]
MODEL = Model.from_text(
    "inertia: {mass: {value: 0.04, unit: kg*m^2}}\nforce:\n"
    "  - linear_spring: {stiffness: {value: 0.8, unit: N*m/rad}, rest_length: {value: 0.0, unit: rad}}\n"
    "  - viscous_damper: {damping: {value: 0.08, unit: N*m*s/rad}}\n",
    catalogue=CATALOGUE,
)


def swung(white: float, effort_noise: float, motion_noise: float) -> Record:
    """An oscillator of 0.03 kg m^2 that follows slow sines and a `white` torque, with noise on the recorded torque and angle."""
    rng, substeps = np.random.default_rng(3), 10
    count, step = round(LONG * RATE), 1.0 / (RATE * substeps)
    time = np.arange(count) / RATE
    torque = sum(0.5 * np.sin(2.0 * np.pi * f * time + p) for f, p in ((0.2, 0.3), (0.45, 1.1), (0.8, 2.0)))
    torque = torque + white * rng.standard_normal(count)
    angle, x, v = np.empty(count), 0.0, 0.0
    for i in range(count):
        angle[i] = x
        for _ in range(substeps):
            v += step * (torque[i] - 0.9 * x - 0.1 * v) / 0.03
            x += step * v
    effort = torque + effort_noise * rng.standard_normal(count)
    angle = angle + motion_noise * rng.standard_normal(count)
    return Record("swung", Channel(time, angle, "rad"), Channel(time, effort, "N*m"), hold="zero")


@pytest.mark.parametrize(
    ("white", "effort_noise", "motion_noise", "noisier"),
    [
        pytest.param(0.0, 0.05, 2e-4, True, id="a noisy effort and a quiet motion"),
        pytest.param(0.0, 0.002, 5e-3, False, id="a quiet effort and a noisy motion"),
        pytest.param(0.2, 0.0, 2e-3, False, id="a white torque that moves the machine"),
        pytest.param(0.0, 0.0, 2e-4, False, id="a command, which has no noise"),
    ],
)
def test_what_has_more_noise_is_told_from_what_excites(white, effort_noise, motion_noise, noisier):
    assert applicable([swung(white, effort_noise, motion_noise)], MODEL).noisier is noisier


def test_the_decision_needs_no_scale_of_the_effort():
    record = swung(0.0, 0.05, 2e-4)
    assert record.input is not None
    scaled = replace(record, input=replace(record.input, value=1e3 * record.input.value))
    model = MODEL.with_values({name: 1e3 * MODEL.value(name) for name in (
        "inertia.mass", "linear_spring.stiffness", "viscous_damper.damping")})  # fmt: skip
    assert applicable([scaled], model).noisier
