"""Actuator rate limit: the force changes by at most R per second (slew rate of an amplifier, speed of a valve).

A memory follows the force, at most at the rate R, with the integration step h as time constant; the output leads the
memory by what one step allows, R h. Where the limit is not reached the output is the input, exactly; a jump of the
input passes up to R h at once. The actuator starts at the force that is asked for.
"""

from math import inf, tau

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(f, t, rate, step, memory):
    output = memory + max(-rate * step, min(rate * step, f - memory))
    return output, (output - memory) / step


ELEMENT = Element(
    name="actuator_rate_limit",
    slot="actuator",
    title="Actuator rate limit",
    equation="|ḟ| ≤ R",
    parameters=(Parameter("rate", "N/s", "largest rate R of the force", bounds=(0.0, inf)),),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("memory",),
    initial=lambda x, v, f, **_: (f,),
    size="rate",
    absent=inf,
    starts=lambda s: [
        {"rate": w * s.effort * tau * s.frequency} for w in (0.7, 1.2, 2.0) if s.effort * s.frequency > 0.0
    ],
    also_known_as=("slew-rate limit", "ramp limit"),
    family="actuator nonlinearity",
    confusable={
        "actuator_lag": "its phase lag grows with amplitude",
        "actuator_saturation": "limits the rate of the force, not the force",
    },
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968",
)
