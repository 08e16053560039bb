"""Sensor lag: first order, tau_s dy/dt = x - y (an anti-alias filter, a slow transducer, a camera's exposure).

It starts as if the machine had always moved at its initial speed: y = x - tau_s v. A lag shorter than an
integration step vanishes smoothly (`elements/first_order_lag.py`).
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter
from rhythmid.elements.first_order_lag import kernel

ELEMENT = Element(
    name="sensor_lag",
    slot="sensor",
    title="Sensor lag",
    equation="τ_s ẏ = x − y",
    parameters=(Parameter("time_constant", "s", "time constant τ_s", bounds=(0.0, inf)),),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("lagged",),
    initial=lambda x, v, f, time_constant, step: (x - time_constant * v,),
    size="time_constant",
    starts=lambda s: [{"time_constant": w / s.natural_frequency} for w in (0.01, 0.05)],
    also_known_as=("sensor low-pass", "measurement filter", "transducer bandwidth"),
    family="lag",
    confusable={
        "actuator_lag": "rolls off with the output's frequency, not the input's: sidebands, large chirps",
        "measurement_delay": "rolls off as well: excite high frequencies",
        "second_mode": "far below its frequency only",
    },
    reference="K. J. Åström, R. M. Murray, Feedback Systems, 2008, section 5.3",
)
