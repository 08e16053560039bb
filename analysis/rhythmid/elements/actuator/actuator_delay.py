"""Actuator delay: a dead time on the whole actuator force, f(t) = f_cmd(t - tau_a) with f_cmd = f0 + u.

What a drive's bus and its current loop take, a valve and its hose. Unlike the input delay it delays the robot's own forcing,
too, and a controller's force: it stands inside the loop, and takes from its damping.

Without a controller, all that drives the machine comes later by tau_a, so the motion does: nothing recorded tells this from a
measurement delay. Only their sum is identifiable then.
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
