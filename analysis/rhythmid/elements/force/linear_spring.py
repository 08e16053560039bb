"""Linear spring: F = -k (x - x_0)."""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, stiffness, rest_length):
    return -stiffness * (x - rest_length)


ELEMENT = Element(
    name="linear_spring",
    slot="force",
    title="Linear spring",
    equation="F = −k (x − x₀)",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness k", bounds=(0.0, inf)),
        Parameter("rest_length", "m", "position x₀ at which the spring is free", default=0.0),
    ),
    kernel=kernel,
    size="stiffness",
    starts=lambda s: [{"stiffness": 0.1 * s.stiffness, "rest_length": s.centre}],
    at_joint={  # it may rest anywhere, and a tenth of the effort moves the joint against it
        "starts": lambda s: [
            {"stiffness": 0.1 * s.effort / s.position, "rest_length": rest}
            for rest in (s.low, s.centre, s.high)
        ]
    },
    also_known_as=("Hooke spring",),
    family="stiffness",
    special_case_of=("bouc_wen_hysteresis", "elastoplastic_hysteresis"),  # for z_y far above the travel
    confusable={"cubic_stiffness": "one amplitude only: repeat at another amplitude"},
    reference="Paper, equation (10)",
)
