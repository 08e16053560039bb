"""Direction-switched viscous damper of the paper's hopper: one damping in stance (v > 0), another in flight.

The switch is at v = 0, where the damper's force is zero: the force is continuous, its slope is not.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, stance, flight):
    return -(stance if v > 0.0 else flight) * v


ELEMENT = Element(
    name="switched_damper",
    slot="force",
    title="Direction-switched damper",
    equation="F = −c_s v for v > 0, −c_f v otherwise",
    parameters=(
        Parameter("stance", "N*s/m", "damping while v > 0", bounds=(0.0, inf)),
        Parameter("flight", "N*s/m", "damping while v ≤ 0", bounds=(0.0, inf), default=0.0),
    ),
    kernel=kernel,
    size="stance",
    candidate=False,
    against="base",
    also_known_as=("hybrid damper", "asymmetric damper"),
    family="damping",
    confusable={"viscous_damper": "no sidebands; adds the same damping to both phases"},
    switches=("v", ""),
    reference="Paper, equation (10)",
)
