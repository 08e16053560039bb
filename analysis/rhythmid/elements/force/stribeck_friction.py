"""Stribeck friction: a Coulomb level that rises towards v = 0, F = -F_c [1 + (r - 1) exp(-(v / v_s)^2)] sgn(v).

r is the ratio of static to kinetic friction, so the rise F_s of the usual form is (r - 1) F_c. The sign is
regularised as in Coulomb friction. Its transition speed v_t is estimated, too; with v_t >= v_s the rise is not
identifiable.
"""

import math

from rhythmid.elements.element import STEP, Element, Parameter

LARGEST_RATIO = 100.0  # of static to kinetic friction: beyond it kinetic friction is below the accuracy of any measured friction


def kernel(x, v, t, f, force, static_ratio, stribeck_speed, transition, mass, step):
    falling = v / max(stribeck_speed, 1e-300)
    level = force * (1.0 + (static_ratio - 1.0) * math.exp(-falling * falling))
    return -level * math.tanh(v / max(transition, 0.5 * static_ratio * force * step / mass, 1e-300))


ELEMENT = Element(
    name="stribeck_friction",
    slot="force",
    title="Stribeck friction",
    equation="F = −(F_c + F_s e^{−(v/v_s)²}) sgn v,  F_s = (r − 1) F_c",
    parameters=(
        Parameter("force", "N", "kinetic friction force F_c", bounds=(0.0, math.inf)),
        Parameter("static_ratio", "1", "ratio r of static to kinetic friction", bounds=(1.0, LARGEST_RATIO)),
        Parameter("stribeck_speed", "m/s", "speed v_s over which friction falls", bounds=(0.0, math.inf)),
        Parameter(
            "transition", "m/s", "speed v_t over which the sign turns", bounds=(0.0, math.inf), default=1e-3
        ),
    ),
    borrows={"mass": ("inertia.mass", None), "step": (STEP, 1e-3)},
    kernel=kernel,
    size="force",
    starts=lambda s: [
        {
            "force": 0.01 * s.force,
            "static_ratio": 3.0,
            "stribeck_speed": w * s.velocity,
            "transition": 0.1 * w * s.velocity,
        }
        for w in (0.2, 0.6)
    ],
    # at a ratio of 1 it is Coulomb friction; at the upper end hardly any kinetic friction is left, and it is a force at low speed only
    ranges=lambda s: {"transition": s.turning, "static_ratio": (1.0, LARGEST_RATIO)},
    against="base",
    also_known_as=("stiction", "static and kinetic friction", "negative viscous friction"),
    family="friction",
    special_case_of=("lugre_friction",),
    confusable={
        "coulomb_friction": "differ near v = 0 alone: dwell at low speed, reverse slowly",
        "lugre_friction": "differ in the displacement before sliding and in the lag of friction behind speed",
    },
    switches=("v", ""),
    reference="B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30(7), 1994, 1083-1138",
)
