"""Actuator gain: the force is g times the commanded one.

With a free mass the gain only scales mass, damping and stiffness, so it is calibration and no missing effect. It is
identifiable if the mass is known by weighing.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, t, gain):
    return gain * f


ELEMENT = Element(
    name="actuator_gain",
    slot="actuator",
    title="Actuator gain",
    equation="f → g f",
    parameters=(Parameter("gain", "1", "gain g", bounds=(0.0, inf), default=1.0),),
    kernel=kernel,
    size="gain",
    absent=1.0,
    candidate=False,  # equivalent to another mass, damping and stiffness
    starts=lambda s: [{"gain": 1.02}],
    at_joint={"candidate": True, "starts": lambda _: [{"gain": 0.9}, {"gain": 1.1}]},
    also_known_as=("force constant", "motor constant error"),
    family="calibration",
    confusable={
        "sensor_gain": "both scale the response; not separable where gravity and forcing are scaled alike",
        "actuator_fade": "constant in time",
    },
    reference="Any text on motion control",
)
