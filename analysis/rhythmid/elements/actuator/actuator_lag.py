"""Actuator lag: first order, tau_a df/dt = f_cmd - f, on the whole actuator force f0 + u.

A lag shorter than one integration step h is computed with the time constant h and a direct share 1 - tau_a / h,
whose transfer function agrees to first order in frequency. So the effect vanishes exactly at tau_a = 0, grows
smoothly from there, and is stable. It starts at the commanded force.
"""

from math import inf

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(f, t, time_constant, step, lagged):
    relaxation = max(time_constant, step)
    return f + (time_constant / relaxation) * (lagged - f), (f - lagged) / relaxation


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
