"""Actuator lag: first order, tau_a df/dt = f_cmd - f, on the whole actuator force f0 + u.

It starts at the commanded force. A lag shorter than an integration step vanishes smoothly (`elements/first_order_lag.py`).
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter
from rhythmid.elements.first_order_lag import kernel

ELEMENT = Element(
    name="actuator_lag",
    slot="actuator",
    title="Actuator lag",
    equation="τ_a ḟ = f_cmd − f,  f_cmd = f₀ + u",
    parameters=(Parameter("time_constant", "s", "time constant τ_a", bounds=(0.0, inf)),),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("lagged",),
    initial=lambda x, v, f, **_: (f,),
    size="time_constant",
    starts=lambda s: [{"time_constant": w / s.natural_frequency} for w in (0.01, 0.05)],
    also_known_as=("first-order actuator dynamics", "motor time constant", "drive bandwidth"),
    family="lag",
    confusable={
        "command_lag": "acts on u alone: the phase and size of the limit cycle; a step of bias force",
        "sensor_lag": "rolls off with the output's frequency, not the input's: sidebands, large chirps",
        "input_delay": "rolls off as well: excite high frequencies",
    },
    reference="K. J. Åström, R. M. Murray, Feedback Systems, 2008, section 5.3",
)
