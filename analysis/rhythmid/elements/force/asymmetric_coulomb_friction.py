"""Coulomb friction whose level depends on the direction: F = -F_c (1 + a sgn v) sgn v, regularised by tanh.

The asymmetric part -F_c a sgn(v)^2 is a constant while the machine slides. Where a rest length or a constant force
is free, it differs from symmetric friction only near v = 0. With those known (a weighed mass, a measured rest
length), its level is identifiable.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter

# beyond, friction would push in one direction: there a constant force acts beside a friction
ONE_SIDED = (-1.0, 1.0)


def kernel(x, v, t, f, force, asymmetry, transition, mass, step):
    sign = math.tanh(v / max(transition, 0.5 * force * step / mass, 1e-300))
    return -force * (1.0 + asymmetry * sign) * sign


ELEMENT = Element(
    name="asymmetric_coulomb_friction",
    slot="force",
    title="Asymmetric Coulomb friction",
    equation="F = −F_c± sgn v,  F_c± = F_c (1 ± a)",
    parameters=(
        Parameter("force", "N", "mean friction force F_c of both directions", bounds=(0.0, math.inf)),
        Parameter(
            "asymmetry", "1", "asymmetry a: F_c (1 + a) for v > 0, F_c (1 − a) for v < 0", bounds=ONE_SIDED
        ),
        Parameter(
            "transition", "m/s", "speed v_t over which the sign turns", bounds=(0.0, math.inf), default=1e-3
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    size="force",
    starts=lambda s: [
        {"force": 0.02 * s.force, "asymmetry": a, "transition": 0.1 * s.velocity} for a in (-0.5, 0.5)
    ],
    ranges=lambda s: {"transition": s.turning, "asymmetry": ONE_SIDED},
    beyond=("constant_force", "coulomb_friction"),
    moving_as=lambda force, asymmetry, **_: (
        ("coulomb_friction", force),
        ("constant_force", -force * asymmetry),
    ),
    against="base",
    also_known_as=("direction-dependent dry friction",),
    family="friction",
    confusable={
        "coulomb_friction": "the same but for a constant force, which a free rest length absorbs",
        "constant_force": "acts at rest and against both directions alike",
    },
    switches=("v", ""),
    reference="B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30(7), 1994, 1083-1138",
)
