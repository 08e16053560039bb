"""Feedback delay: a controller uses the position and the speed at an earlier time, x(t - tau_f) and v(t - tau_f).

It is the time that a controller's own measurement and its computation take, inside the loop. It does not delay the
reference: the computation time of the reference is part of the input delay. The delay shifts the phase of the loop
and reduces its damping by k_p tau_f.
"""

from rhythmid.elements.dead_time import dead_time
from rhythmid.elements.element import Element


def kernel(x, v, t, delay, past_x, past_v):
    return past_x, past_v


ELEMENT = Element(
    name="feedback_delay",
    slot="command",
    title="Feedback delay",
    equation="F = k_p (r − x(t − τ_f)) − k_d v(t − τ_f)",
    **dead_time("delay τ_f of the controller's measurement and computation"),
    kernel=kernel,
    acts="observation",
    history=("x", "v"),
    also_known_as=("loop delay", "controller latency", "sampling and computation delay"),
    confusable={
        "actuator_delay": "leaves reference and forcing alone: know the input delay, with a forcing the measurement delay",
        "viscous_damper": "to first order a damping of −k_p τ_f: give the derivative gain, move fast",
        "measurement_delay": "acts inside the loop: the measurement delay is that of the record alone",
    },
    reference="K. J. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd ed., 1997, section 2.3",
)
