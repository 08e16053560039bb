"""Sensor nonlinearity: y + beta (y - x_r)^2, the curvature of a sensor characteristic.

A shift of x_r adds a gain and an offset. Where mass and rest length are free, these are absorbed, and x_r is arbitrary.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(y, t, coefficient, reference):
    return y + coefficient * (y - reference) * (y - reference)


ELEMENT = Element(
    name="sensor_nonlinearity",
    slot="sensor",
    title="Sensor nonlinearity",
    equation="y → y + β (y − x_r)²",
    parameters=(
        Parameter("coefficient", "1/m", "curvature β"),
        Parameter("reference", "m", "position x_r at which gain and offset are right", default=0.0),
    ),
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.01 / s.position, "reference": s.centre}],
    # outside the travel it is a gain and an offset within the motion
    ranges=lambda s: {"reference": (s.low, s.high)},
    also_known_as=("characteristic curve", "sensor curvature"),
    family="sensor nonlinearity",
    confusable={
        "quadratic_stiffness": "moves the resonance with a bias; a sensor does not",
        "sensor_gain": "small motions about another position",
    },
    reference="J. Fraden, Handbook of Modern Sensors, 5th ed., 2016, chapter 3",
)
