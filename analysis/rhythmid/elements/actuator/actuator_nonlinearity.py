"""Actuator nonlinearity: cubic compression f - gamma f^3 (magnetic saturation), or expansion for gamma < 0.

It is meant for weak compression: beyond |f| = 1 / sqrt(3 gamma) the law decreases again, which no actuator does.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(f, t, coefficient):
    return f - coefficient * f * f * f


ELEMENT = Element(
    name="actuator_nonlinearity",
    slot="actuator",
    title="Actuator nonlinearity",
    equation="f → f − γ f³",
    parameters=(Parameter("coefficient", "1/N^2", "coefficient γ; positive compresses"),),
    kernel=kernel,
    size="coefficient",
    starts=lambda s: [{"coefficient": 0.01 / s.effort**2}] if s.effort > 0.0 else [],
    also_known_as=("force compression", "magnetic saturation"),
    family="actuator nonlinearity",
    confusable={
        "actuator_saturation": "smooth compression instead of a sharp limit: vary the amplitude around it",
        "actuator_deadband": "odd too, but strongest at small forces",
        "actuator_gain": "one amplitude only",
    },
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968",
)
