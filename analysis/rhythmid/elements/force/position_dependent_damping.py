"""Position-dependent damping: F = -c_x (x - x_r)^n v, for instance a tapered dashpot or an eddy-current brake.

A shift of x_r adds plain viscous damping, so with n = 1 and a free viscous damper x_r is arbitrary. The sign of c_x
is free: another damper keeps the total positive.
"""

import math

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient, reference, exponent):
    return -coefficient * (x - reference) ** math.floor(exponent + 0.5) * v


ELEMENT = Element(
    name="position_dependent_damping",
    slot="force",
    title="Position-dependent damping",
    equation="F = −c_x (x − x_r)ⁿ v",
    parameters=(
        Parameter("coefficient", "N*s/m^2", "coefficient c_x (for n = 1; per m^n more generally)"),
        Parameter("reference", "m", "position x_r at which it vanishes", default=0.0),
        Parameter("exponent", "1", "whole number n", bounds=(1.0, 4.0), default=1.0, fixed=True),
    ),
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [
        {"coefficient": 0.02 * s.damping / s.position**n, "reference": s.centre, "exponent": n}
        for n in (1.0, 2.0)
    ],
    also_known_as=("tapered dashpot", "position-sensitive damping"),
    family="damping",
    placed=True,
    confusable={
        "viscous_damper": "the same while the machine stays at one position: move it with a bias force",
        "quadratic_stiffness": "in phase with position, not with speed",
    },
    reference="J. C. Dixon, The Shock Absorber Handbook, 2nd ed., 2007",
)
