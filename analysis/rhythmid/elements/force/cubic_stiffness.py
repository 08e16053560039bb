"""Cubic stiffness: F = -k_3 e^3 with e = x - rest length; k_3 > 0 hardens (Duffing's oscillator), k_3 < 0 softens."""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient, rest_length):
    e = x - rest_length
    return -coefficient * e * e * e


ELEMENT = Element(
    name="cubic_stiffness",
    slot="force",
    title="Cubic stiffness",
    equation="F = −k₃ e³,  e = x − x₀",
    parameters=(Parameter("coefficient", "N/m^3", "coefficient k₃; positive hardens, negative softens"),),
    borrows={"rest_length": ("linear_spring.rest_length", 0.0)},
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.03 * s.stiffness / (s.position + abs(s.centre)) ** 2}],
    also_known_as=("Duffing spring", "hardening spring", "softening spring"),
    family="stiffness",
    confusable={
        "linear_spring": "one amplitude only: the resonance moves with the square of the amplitude",
        "quadratic_stiffness": "the same tangent away from e = 0: large amplitudes, a bias force of both signs",
        "quintic_stiffness": "one amplitude only",
        "pendulum_gravity": "a softening cubic is its leading term: use large swings",
    },
    reference="I. Kovacic, M. J. Brennan (eds.), The Duffing Equation, Wiley, 2011",
)
