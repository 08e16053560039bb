"""Sensor offset: y = x + o.

A free rest length absorbs it exactly, so it is calibration and no missing effect.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(y, t, offset):
    return y + offset


ELEMENT = Element(
    name="sensor_offset",
    slot="sensor",
    title="Sensor offset",
    equation="y → y + o",
    parameters=(Parameter("offset", "m", "offset o", default=0.0),),
    kernel=kernel,
    size="offset",
    candidate=False,  # equivalent to another rest length
    starts=lambda s: [{"offset": 0.05 * s.position}],
    also_known_as=("zero error", "bias"),
    family="calibration",
    confusable={"constant_force": "not separable where a spring's rest length is free"},
    reference="J. Fraden, Handbook of Modern Sensors, 5th ed., 2016, chapter 3",
)
