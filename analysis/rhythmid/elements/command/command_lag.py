"""Command lag: first order, tau du_bar/dt = u - u_bar, on the command u alone; the robot's own forcing is not lagged.

It starts at the command. A lag shorter than an integration step vanishes smoothly (`elements/first_order_lag.py`).
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter
from rhythmid.elements.first_order_lag import kernel

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
