"""Actuator delay: a dead time on the whole actuator force, f(t) = f_cmd(t - tau_a) with f_cmd = f0 + u.

Examples: the bus and the current loop of a drive, or a valve and its hose. Unlike the input delay it also delays the robot's own
forcing and a controller's force. It is inside the control loop, and reduces its damping.

Without a controller, tau_a delays all inputs of the machine, and so the motion. It is then observationally
equivalent to a measurement delay, and only their sum is identifiable.
"""

from rhythmid.elements.dead_time import dead_time
from rhythmid.elements.element import Element


def kernel(f, t, delay, past_f):
    return past_f


ELEMENT = Element(
    name="actuator_delay",
    slot="actuator",
    title="Actuator delay",
    equation="f(t) = f_cmd(t − τ_a),  f_cmd = f₀ + u",
    **dead_time("dead time τ_a of the actuator"),
    kernel=kernel,
    history=("f",),
    also_known_as=("actuator dead time", "transport delay of the actuator", "drive latency"),
    confusable={
        "measurement_delay": "the same where no controller closes the loop",
        "feedback_delay": "delays reference and forcing, too: know the input delay, with a forcing the measurement delay",
        "input_delay": "delays the forcing, too, and stands inside a controller's loop",
        "actuator_lag": "rolls off as well: excite high frequencies",
    },
    reference="K. J. Åström, R. M. Murray, Feedback Systems, 2008, section 9.2",
)
