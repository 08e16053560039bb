"""Sensor gain: y = g x, a scale error.

With a free mass the gain only scales mass, damping and stiffness, so it is calibration and no missing effect.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(y, t, gain):
    return gain * y


ELEMENT = Element(
    name="sensor_gain",
    slot="sensor",
    title="Sensor gain",
    equation="y → g y",
    parameters=(Parameter("gain", "1", "gain g", bounds=(0.0, inf), default=1.0),),
    kernel=kernel,
    size="gain",
    absent=1.0,
    candidate=False,  # equivalent to another mass, damping, stiffness and rest length
    starts=lambda s: [{"gain": 1.02}],
    also_known_as=("scale error", "sensitivity error"),
    family="calibration",
    confusable={"actuator_gain": "both scale the response; separable with a known mass and a known length"},
    reference="J. Fraden, Handbook of Modern Sensors, 5th ed., 2016, chapter 3",
)
