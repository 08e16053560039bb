"""Gravity of a pendulum or a robot's link: torque F = -G sin(x - x_r), with G = m g l and x_r the hanging position.

For rotational machines: x is an angle in rad. A candidate for motions of at least 0.2 rad about the middle: below,
the sine is linear to within 0.7 % of its force.
"""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, moment, reference):
    return -moment * math.sin(x - reference)


# [rad] amplitude a below which the sine and a line differ by less than a^2 / 6, 0.7 % of the force
LEAST_SWING = 0.2


def starts(scales):
    """Hanging at the middle of the motion, and rotated from there: an arm's link may hang outside its travel. None
    for a small motion."""
    if 0.5 * (scales.high - scales.low) < LEAST_SWING:
        return []
    moment = max(0.1 * scales.stiffness, 0.1 * scales.effort)
    turns = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi)
    return [{"moment": moment, "reference": scales.centre + turn} for turn in turns]


ELEMENT = Element(
    name="pendulum_gravity",
    slot="force",
    title="Pendulum gravity",
    equation="F = −G sin(x − x_r),  G = m g l",
    parameters=(
        Parameter("moment", "N", "torque amplitude G = m g l", bounds=(0.0, math.inf)),
        Parameter("reference", "m", "angle x_r at which it hangs at rest", default=0.0, turn=2.0 * math.pi),
    ),
    kernel=kernel,
    acts="body",
    rotational=True,
    size="moment",
    starts=starts,
    also_known_as=("gravity torque", "link weight"),
    family="stiffness",
    confusable={
        "linear_spring": "small swings: F ≈ −G (x − x_r)",
        "cubic_stiffness": "a softening cubic is its next term: use large swings",
    },
    reference="Any text on mechanics, e.g. L. D. Landau, E. M. Lifshitz, Mechanics, section 5",
)
