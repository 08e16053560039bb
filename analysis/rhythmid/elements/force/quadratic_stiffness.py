"""Quadratic stiffness: F = -k_2 e^2 with e = x - rest length: a spring that is stiffer on one side."""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, coefficient, rest_length):
    e = x - rest_length
    return -coefficient * e * e


ELEMENT = Element(
    name="quadratic_stiffness",
    slot="force",
    title="Quadratic stiffness",
    equation="F = −k₂ e²,  e = x − x₀",
    parameters=(Parameter("coefficient", "N/m^2", "coefficient k₂, of either sign"),),
    borrows={"rest_length": ("linear_spring.rest_length", 0.0)},
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.03 * s.stiffness / (s.position + abs(s.centre))}],
    also_known_as=("asymmetric spring", "even stiffness"),
    family="stiffness",
    confusable={
        "cubic_stiffness": "the same tangent away from e = 0: large amplitudes, a bias force of both signs",
        "sensor_nonlinearity": "leaves the motion alone: second harmonic without a change of resonance",
        "bilinear_stiffness": "a smooth curve instead of a kink: vary the amplitude",
    },
    reference="A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley, 1979",
)
