"""Input delay: the command u acts tau_u seconds after its stamp, u_bar(t) = u(t - tau_u).

The forcing f0, generated on the robot, is not delayed; this makes the two delays separately identifiable.
"""

import math

import numpy as np

from rhythmid.elements.element import Element, Parameter


def delay_of(stamps, delay):
    return np.full(len(stamps), delay)


ELEMENT = Element(
    name="input_delay",
    slot="command",
    title="Input delay",
    equation="ū(t) = u(t − τ_u)",
    parameters=(Parameter("delay", "s", "delay τ_u of the command", bounds=(0.0, math.inf), default=0.0),),
    delay=delay_of,
    size="delay",
    candidate=False,
    also_known_as=("command latency", "dead time"),
    confusable={
        "measurement_delay": "separable only through sidebands or a limit cycle of known phase",
        "command_lag": "rolls off as well; excite high frequencies",
    },
    reference="Paper, section 3.1",
)
