"""Quintic stiffness: F = -k_5 e^5 with e = x - rest length: the additional force of a hardening spring at the
largest amplitudes."""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient, rest_length):
    e = x - rest_length
    square = e * e
    return -coefficient * square * square * e


ELEMENT = Element(
    name="quintic_stiffness",
    slot="force",
    title="Quintic stiffness",
    equation="F = −k₅ e⁵,  e = x − x₀",
    parameters=(Parameter("coefficient", "N/m^5", "coefficient k₅; positive hardens, negative softens"),),
    borrows={"rest_length": ("linear_spring.rest_length", 0.0)},
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.03 * s.stiffness / (s.position + abs(s.centre)) ** 4}],
    also_known_as=("fifth-order stiffness",),
    family="stiffness",
    confusable={
        "cubic_stiffness": "one amplitude only: the resonance moves with the fourth power of the amplitude"
    },
    reference="I. Kovacic, M. J. Brennan (eds.), The Duffing Equation, Wiley, 2011",
)
