"""Actuator rate limit: the force changes by at most R per second (slew rate of an amplifier, speed of a valve).

The output moves from its memory state towards the force, at most by R times the elapsed time. That is exact where
the input is held or stays on one side of the limit during an integration step, and of second order in the step
otherwise. The actuator starts at the commanded force.
"""

import math
from math import inf, tau

from rhythmid.elements.element import ELAPSED, Element, Parameter


def kernel(f, t, rate, elapsed, memory):
    output = f
    if abs(f - memory) > rate * elapsed:  # never for an infinite rate
        output = memory + math.copysign(rate * elapsed, f - memory)
    return output, output


ELEMENT = Element(
    name="actuator_rate_limit",
    slot="actuator",
    title="Actuator rate limit",
    equation="|ḟ| ≤ R",
    parameters=(Parameter("rate", "N/s", "largest rate R of the force", bounds=(0.0, inf)),),
    borrows={"elapsed": (ELAPSED, 1e-3)},
    kernel=kernel,
    memories=("memory",),
    initial=lambda x, v, f, **_: (f,),
    size="rate",
    absent=inf,
    starts=lambda s: [
        {"rate": w * s.effort * tau * max(s.frequency, s.natural_frequency)}
        for w in (0.4, 0.8, 1.6, 3.2)
        if s.effort > 0.0
    ],
    also_known_as=("slew-rate limit", "ramp limit"),
    family="actuator nonlinearity",
    confusable={
        "actuator_lag": "its phase lag grows with amplitude",
        "actuator_saturation": "limits the rate of the force, not the force",
    },
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968",
)
