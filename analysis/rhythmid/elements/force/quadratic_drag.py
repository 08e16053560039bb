"""Quadratic drag of a fluid at high Reynolds number: F = -c_2 v |v|."""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient):
    return -coefficient * v * abs(v)


ELEMENT = Element(
    name="quadratic_drag",
    slot="force",
    title="Quadratic drag",
    equation="F = −c₂ v |v|",
    parameters=(
        Parameter("coefficient", "N*s^2/m^2", "drag coefficient c₂ = ρ c_w A / 2", bounds=(0.0, inf)),
    ),
    kernel=kernel,
    acts="body",
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.03 * s.damping / s.velocity}],
    also_known_as=("aerodynamic drag", "air resistance", "quadratic damping"),
    family="damping",
    confusable={
        "viscous_damper": "one amplitude only: drag's apparent damping grows with amplitude",
        "flight_damping": "one amplitude only: triple the forcing, or a chirp of large amplitude",
    },
    reference="L. D. Landau, E. M. Lifshitz, Fluid Mechanics, section 45",
)
