"""A joint with its load behind an elastic gear, driven by a current, of which only the speed is recorded.

A rigid nominal model loses it altogether; tied to the record, what it lacks is named all the same.
"""

import numpy as np
import pytest
from synthetic import integrate, noisy, tones

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

MOTOR, LOAD, STIFFNESS, LOSS, FRICTION, CONSTANT = 0.02, 0.015, 12.0, 0.01, 0.05, 0.35
PERIOD = 2e-3
NOMINAL = """
units: {force: A, position: rad}
inertia: {mass: {value: 0.05}}
force: [{viscous_damper: {damping: {value: 0.2}}}]
"""


def records() -> list[Record]:
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 10.0, PERIOD)

    def record(rms: float) -> Record:
        wanted = tones(rng, rms, 0.2, 12.0)
        held = np.array([wanted(t) for t in time])

        def rates(t: float, s: np.ndarray) -> list[float]:
            current = held[min(int(t / PERIOD + 1e-9), len(held) - 1)]
            torque = CONSTANT * current - FRICTION * s[1]
            twist = STIFFNESS * (s[2] - s[0]) + LOSS * (s[3] - s[1])
            return [s[1], (torque + twist) / MOTOR, s[3], -twist / LOAD]

        states = integrate(rates, [0.0, 0.0, 0.0, 0.0], time, PERIOD / 2)
        speed = Channel(time, noisy(rng, states[:, 1], 0.02), "rad/s")
        return Record(f"joint {rms}", speed, Channel(time, held, "A"), output_kind="velocity")

    return [record(1.0), record(2.5)]


@pytest.mark.long
def test_an_elastic_gear_is_named_and_measured_though_the_rigid_model_loses_the_joint():
    result = diagnose(records(), Model.from_text(NOMINAL)).diagnosis
    assert [effect.element for effect in result.missing] == ["second_mode"]
    frequency = result.missing[0].parameters["frequency"]
    true = float(np.sqrt(STIFFNESS / LOAD)) / (2.0 * np.pi)
    assert frequency.std is not None and abs(frequency.value - true) < 4.0 * frequency.std < 0.1 * true
