"""Quadratic damping of an orifice: F = -c_2 v |v|, v the speed of the mass relative to the base that it stands on.

A hydraulic damper moves with its base; the air that drags on the mass does not. Where the base stands still the two are one.
"""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient):
    return -coefficient * v * abs(v)


ELEMENT = Element(
    name="quadratic_damping",
    slot="force",
    title="Quadratic damping",
    equation="F = −c₂ v |v|,  v relative to the base",
    parameters=(
        Parameter(
            "coefficient", "N*s^2/m^2", "coefficient c₂ of the damper's turbulent flow", bounds=(0.0, inf)
        ),
    ),
    kernel=kernel,
    displaced_base=True,
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.03 * s.damping / s.velocity}],
    also_known_as=("orifice damping", "hydraulic damper", "shock absorber"),
    family="damping",
    confusable={
        "quadratic_drag": "depends on the speed through the room: far above the resonance the base moves and the mass does not",
        "viscous_damper": "one amplitude only: quadratic damping grows with amplitude",
    },
    reference="J. C. Dixon, The Shock Absorber Handbook, 2nd ed., 2007, chapter 6",
)
