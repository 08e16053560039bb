"""Gravity along the axis of motion: F = -m g.

Along one axis it is indistinguishable from a constant force or from the spring's rest length. It is a nominal
element with a known value.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, acceleration, mass):
    return -mass * acceleration


ELEMENT = Element(
    name="gravity",
    slot="force",
    title="Gravity",
    equation="F = −m g",
    parameters=(Parameter("acceleration", "m/s^2", "gravitational acceleration along −x", default=9.81),),
    borrows={"mass": ("inertia.mass", None)},
    kernel=kernel,
    acts="body",
    candidate=False,
    confusable={
        "constant_force": "not separable along one axis: known by its value",
        "sensor_offset": "not separable from the spring's rest length",
    },
    reference="Paper, equation (10)",
)
