"""A hopper that is off the ground for a fifth of the time or more, by equations of its own; its nominal model never leaves it.

Refitted, the nominal model comes out far too soft; what is missing is found from the values that it was given with.
"""

import numpy as np
import pytest
from synthetic import integrate, noisy, tones

from rhythmid.diagnose.diagnosis import diagnose
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

MASS, STIFFNESS, DAMPING, REST, GRAVITY, PERIOD = 1.1, 900.0, 7.0, 0.3, 9.81, 2e-3
NOMINAL = """
inertia: {mass: {value: 1.1, unit: kg, fixed: true}}
force:
  - gravity: {acceleration: {value: 9.81, unit: m/s^2, fixed: true}}
  - linear_spring: {stiffness: {value: 765.0, unit: N/m}, rest_length: {value: 0.29, unit: m}}
  - viscous_damper: {damping: {value: 9.8, unit: N*s/m}}
"""


def records() -> list[Record]:
    rng = np.random.default_rng(17)
    time = np.arange(0.0, 5.0, PERIOD)

    def one(level: float) -> Record:
        shaking = tones(rng, 3.0 * level, 0.5, 7.0)
        held = np.array([shaking(t) + 4.0 * level * np.sin(7.0 * np.pi * t) for t in time])

        def rates(t: float, s: np.ndarray) -> list[float]:
            push = held[min(int(t / PERIOD + 1e-9), len(held) - 1)]
            depth = REST - s[0]
            leg = STIFFNESS * depth - DAMPING * s[1] if depth > 0.0 else 0.0
            return [s[1], (push - MASS * GRAVITY + leg) / MASS]

        states = integrate(rates, [REST - MASS * GRAVITY / STIFFNESS, 0.0], time, PERIOD / 2)
        assert (states[:, 0] > REST).mean() > 0.2
        height = Channel(time, noisy(rng, states[:, 0], 2e-4), "m")
        return Record(f"hopper {level}", height, Channel(time, held, "N"))

    return [one(1.0), one(1.4)]


@pytest.mark.long
def test_a_hopper_that_leaves_the_ground_is_told_so_and_its_leg_is_measured():
    result = diagnose(records(), Model.from_text(NOMINAL)).diagnosis
    assert result.verdict == "missing_physics"
    assert [effect.element for effect in result.missing] == ["ground_contact_loss"]
    assert result.missing[0].parameters["loss"].value == pytest.approx(1.0, abs=0.02)
    assert result.parameters["linear_spring.stiffness"].value == pytest.approx(STIFFNESS, rel=0.02)
    assert result.parameters["linear_spring.rest_length"].value == pytest.approx(REST, abs=1e-3)
