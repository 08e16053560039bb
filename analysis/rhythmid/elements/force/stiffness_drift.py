"""Stiffness drift: the linear spring's stiffness changes with time, k (1 + alpha t), because of temperature, wear
or creep.

t is the record's time; the drift begins at its start.
"""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, rate, stiffness, rest_length):
    return -stiffness * rate * max(t, 0.0) * (x - rest_length)


ELEMENT = Element(
    name="stiffness_drift",
    slot="force",
    title="Stiffness drift",
    equation="F = −k α t e,  e = x − x₀",
    parameters=(Parameter("rate", "1/s", "relative rate α of the stiffness"),),
    borrows={
        "stiffness": ("linear_spring.stiffness", None),
        "rest_length": ("linear_spring.rest_length", 0.0),
    },
    kernel=kernel,
    size="rate",
    starts=lambda s: [{"rate": 0.005 / s.duration}],
    also_known_as=("thermal softening", "wear", "ageing"),
    family="drift",
    confusable={
        "stiffness_jump": "a ramp instead of a step",
        "sensor_drift": "moves the resonance too: repeat the first experiment at the end",
        "actuator_fade": "moves the resonance, not the gain",
    },
    reference="A. H. Nayfeh, Perturbation Methods, Wiley, 1973, on slowly varying coefficients",
)
