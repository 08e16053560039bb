"""Viscoelastic relaxation: a Maxwell branch, F = -k_m (x - w), dw/dt = (x - w) / tau_m.

With a linear spring it is the standard linear solid. For tau_m -> 0 it is a viscous damper k_m tau_m. A relaxation
shorter than one integration step is computed as that limit, scaled to the correct damping at low frequency.
The branch starts relaxed.
"""

from math import inf, tau

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, stiffness, time_constant, step, relaxed):
    relaxation = max(time_constant, step)
    stretch = x - relaxed
    return -stiffness * (time_constant / relaxation) * stretch, stretch / relaxation


ELEMENT = Element(
    name="viscoelastic_relaxation",
    slot="force",
    title="Viscoelastic relaxation",
    equation="F = −k_m (x − w),  ẇ = (x − w)/τ_m",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness k_m of the branch", bounds=(0.0, inf)),
        Parameter("time_constant", "s", "relaxation time τ_m", bounds=(0.0, inf)),
    ),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("relaxed",),
    initial=lambda x, v, f, stiffness, time_constant, step: (x,),
    size="stiffness",
    starts=lambda s: [
        {
            "stiffness": 0.02 * s.stiffness * max(1.0, 0.3 / w),
            "time_constant": w / (tau * s.natural_frequency),
        }
        for w in (0.15, 0.7, 3.0)
    ],
    # a slower one relaxes only once in the record, like a drift
    ranges=lambda s: {"time_constant": (0.0, 0.25 * s.duration)},
    also_known_as=("Maxwell branch", "Zener solid", "standard linear solid", "creep"),
    family="damping",
    confusable={
        "viscous_damper": "its limit for short relaxation times: excite high frequencies",
        "flight_damping": "a viscous damper in both phases with less stance damping: bias force, high frequencies",
        "elastoplastic_hysteresis": "its loop depends on speed: repeat slower",
    },
    reference="W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976",
)
