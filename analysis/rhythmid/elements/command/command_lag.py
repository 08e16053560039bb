"""Command lag: first order, tau du_bar/dt = u - u_bar, on the command u alone; the robot's own forcing is not lagged.

A lag shorter than one integration step h is computed with the time constant h and a direct share 1 - tau / h, whose
transfer function agrees to first order in frequency. So the effect vanishes exactly at tau = 0, grows smoothly from
there, and is stable. It starts at the command.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(f, t, time_constant, step, lagged):
    relaxation = max(time_constant, step)
    return f + (time_constant / relaxation) * (lagged - f), (f - lagged) / relaxation


ELEMENT = Element(
    name="command_lag",
    slot="command",
    title="Command lag",
    equation="τ_c dū/dt = u − ū",
    parameters=(Parameter("time_constant", "s", "time constant τ_c", bounds=(0.0, inf)),),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("lagged",),
    initial=lambda x, v, f, **_: (f,),
    size="time_constant",
    starts=lambda s: [{"time_constant": w / s.natural_frequency} for w in (0.01, 0.05)],
    also_known_as=("drive lag", "command filter", "set-point smoothing"),
    family="lag",
    confusable={
        "input_delay": "rolls off as well: excite high frequencies, large amplitudes",
        "actuator_lag": "leaves the limit cycle alone",
        "command_hold": "half the hold's period is a delay, too: rolls off differently",
    },
    reference="K. J. Åström, R. M. Murray, Feedback Systems, 2008, section 5.3",
)
