"""Gravity of a pendulum or a robot's link: torque F = -G sin(x - x_r), with G = m g l and x_r the hanging position.

For rotational machines: x is an angle in rad.
"""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, moment, reference):
    return -moment * math.sin(x - reference)


ELEMENT = Element(
    name="pendulum_gravity",
    slot="force",
    title="Pendulum gravity",
    equation="F = −G sin(x − x_r),  G = m g l",
    parameters=(
        Parameter("moment", "N", "torque amplitude G = m g l", bounds=(0.0, math.inf)),
        Parameter("reference", "m", "angle x_r at which it hangs at rest", default=0.0),
    ),
    kernel=kernel,
    acts="body",
    rotational=True,
    size="moment",
    starts=lambda s: [{"moment": 0.1 * s.stiffness, "reference": s.centre}],
    also_known_as=("gravity torque", "link weight"),
    family="stiffness",
    confusable={
        "linear_spring": "small swings: F ≈ −G (x − x_r)",
        "cubic_stiffness": "a softening cubic is its next term: swing wide",
    },
    reference="Any text on mechanics, e.g. L. D. Landau, E. M. Lifshitz, Mechanics, section 5",
)
