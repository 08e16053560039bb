"""Actuator saturation: the force is limited to [-L, L]. It is not identifiable while the force stays within the limit."""

from math import inf

from rhythmid.elements.element import Element, Parameter


def kernel(f, t, limit):
    return max(-limit, min(limit, f))


ELEMENT = Element(
    name="actuator_saturation",
    slot="actuator",
    title="Actuator saturation",
    equation="f → clip(f, −L, L)",
    parameters=(Parameter("limit", "N", "largest force L", bounds=(0.0, inf)),),
    kernel=kernel,
    size="limit",
    absent=inf,
    starts=lambda s: [  # the last two limit only the highest peaks
        {"limit": limit}
        for limit in (
            *(w * s.effort for w in (1.0, 1.4, 2.0, 3.0)),
            0.9 * s.peak_effort,
            0.97 * s.peak_effort,
        )
        if limit > 0.0
    ],
    also_known_as=("force limit", "current limit", "clipping"),
    family="actuator nonlinearity",
    confusable={
        "actuator_nonlinearity": "a sharp limit instead of smooth compression: vary the amplitude around it",
        "actuator_rate_limit": "limits the force, not its rate",
    },
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968",
)
