"""LuGre friction: bristles that bend before they slide, with the Stribeck curve as steady state.

F = -(sigma_0 z + sigma_1 dz/dt), dz/dt = v - sigma_0 |v| z / g(v), g(v) = F_c [1 + (r - 1) exp(-(v / v_s)^2)], written
with the presliding displacement z_c = F_c / sigma_0, the bristle's damping time T = sigma_1 / sigma_0 and the state
z / z_c. A viscous part is a separate `viscous_damper`. Where the mass travels more than z_c in one integration
step, the bristles bend over that travel instead, which does not change the steady state.

Five parameters are too many for the search. Use it as the friction of a plant, or try it by hand where both
`stribeck_friction` and `elastoplastic_hysteresis` have been reported.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter


def kernel(x, v, t, f, force, static_ratio, stribeck_speed, presliding, damping_time, step, share):
    falling = v / max(stribeck_speed, 1e-300)
    level = 1.0 + (static_ratio - 1.0) * math.exp(-falling * falling)
    rate = (v - abs(v) * share / level) / max(presliding, abs(v) * step, 1e-300)
    return -force * (share + damping_time * rate), rate


ELEMENT = Element(
    name="lugre_friction",
    slot="force",
    title="LuGre friction",
    equation="F = −(σ₀ z + σ₁ ż),  ż = v − σ₀ |v| z / g(v),  g = F_c + F_s e^{−(v/v_s)²},  F_s = (r − 1) F_c",
    parameters=(
        Parameter("force", "N", "kinetic friction force F_c", bounds=(0.0, math.inf)),
        Parameter(
            "static_ratio", "1", "ratio r of static to kinetic friction", bounds=(1.0, 100.0), default=1.0
        ),
        Parameter(
            "stribeck_speed",
            "m/s",
            "speed v_s over which friction falls",
            bounds=(0.0, math.inf),
            default=1e-3,
        ),
        Parameter("presliding", "m", "displacement z_c = F_c/σ₀ before sliding", bounds=(0.0, math.inf)),
        Parameter(
            "damping_time", "s", "bristle damping over stiffness σ₁/σ₀", bounds=(0.0, math.inf), default=0.0
        ),
    ),
    borrows={"step": (STEP, 1e-3)},
    kernel=kernel,
    states=("share",),
    size="force",
    candidate=False,
    starts=lambda s: [
        {
            "force": 0.02 * s.force,
            "static_ratio": 1.5,
            "stribeck_speed": 0.3 * s.velocity,
            "presliding": 0.1 * s.position,
            "damping_time": 0.0,
        }
    ],
    against="base",
    also_known_as=("dynamic friction", "bristle model"),
    family="friction",
    confusable={
        "stribeck_friction": "the same once sliding",
        "elastoplastic_hysteresis": "the same without the Stribeck fall (r = 1)",
    },
    reference="C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, IEEE TAC 40(3), 1995, 419-425",
)
