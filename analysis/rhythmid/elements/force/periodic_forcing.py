"""Periodic forcing f0(t) = A cos(2 pi f t + phi), generated on the robot: it keeps the machine on its limit cycle.

It is added to the command before the actuator. A record with the forcing as a channel needs no such element.
"""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(t, amplitude, frequency, phase):
    return amplitude * math.cos(2.0 * math.pi * frequency * t + phase)


ELEMENT = Element(
    name="periodic_forcing",
    slot="force",
    title="Periodic forcing",
    equation="f₀ = A cos(2π f t + φ)",
    parameters=(
        Parameter("amplitude", "N", "amplitude A"),
        Parameter("frequency", "Hz", "pumping frequency f = 1/T", bounds=(0.0, math.inf)),
        Parameter("phase", "rad", "phase φ at t = 0", default=0.0, turn=2.0 * math.pi),
    ),
    kernel=kernel,
    acts="drive",
    size="amplitude",
    candidate=False,
    also_known_as=("pumping force", "clock-driven forcing"),
    reference="Paper, section 4.3",
)
