"""Reference rate limit: a controller's reference follows the command, but changes by at most R per second.

Hobby servos and drives with a set-point ramp do this; it limits the speed, not the force. The output moves from its
memory state towards the command, at most by R times the elapsed time, which is exact for a held command. It starts
at the machine's position.
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
    name="reference_rate_limit",
    slot="command",
    title="Reference rate limit",
    equation="|dr/dt| ≤ R",
    parameters=(Parameter("rate", "m/s", "largest rate R of the reference", bounds=(0.0, inf)),),
    borrows={"elapsed": (ELAPSED, 1e-3)},
    kernel=kernel,
    memories=("memory",),
    initial=lambda x, v, f, **_: (x,),
    size="rate",
    absent=inf,
    controlled=True,
    starts=lambda s: [
        {"rate": w * (s.reference or s.position) * tau * s.frequency} for w in (1.0, 2.0, 4.0, 8.0)
    ],
    at_joint={  # if the limit acts most of the time, the reference and the joint move at that rate
        "starts": lambda s: [{"rate": share * s.velocity} for share in (0.7, 1.0, 1.4, 2.0, 2.8, 4.0)]
    },
    also_known_as=("set-point ramp", "speed limit of a servo", "slew-rate limit"),
    family="command nonlinearity",
    confusable={
        "actuator_rate_limit": "limits the force's rate, not the reference's",
        "actuator_saturation": "limits the force: the acceleration of large moves, not their speed",
        "command_lag": "its lag grows with amplitude",
    },
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968",
)
